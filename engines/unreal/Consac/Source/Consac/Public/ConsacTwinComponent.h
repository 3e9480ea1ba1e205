// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "Components/ActorComponent.h"
#include "Components/SceneComponent.h"
#include "Engine/StaticMesh.h"
#include "Templates/PimplPtr.h"
#include "UObject/ObjectPtr.h"
#include "ConsacTwin.h"
#include "ConsacTwinComponent.generated.h"

class UPrimitiveComponent;
struct FConsacTwinState;

/** Who moves a twin's joints. */
UENUM(BlueprintType)
enum class EConsacTwinMotion : uint8
{
	/** The nodes: a joint is where it was set. */
	Kinematic,
	/** Physics: each link that a joint moves is a body, by its first mesh; a joint's drive brings it to where it was set. Not tried in an Unreal yet. */
	Physics
};

/** What a link of a twin looks like. */
USTRUCT(BlueprintType)
struct CONSAC_API FConsacTwinMesh
{
	GENERATED_BODY()

	/** The link that it hangs on. A link may have several. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Twin")
	FName Link;

	/** Its mesh. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Twin")
	TObjectPtr<UStaticMesh> Mesh;

	/** Where the mesh is in the link's frame, as the node of twin.glb that has it says. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Twin")
	FTransform Place;
};

/** A robot whose joints move: a component stands where each joint is, and in it one that turns about its X axis, or slides along it, with what hangs
 *  on the joint below. Made when it begins to play. Angles are degrees, lengths centimetres. */
UCLASS(ClassGroup=(Consac), meta=(BlueprintSpawnableComponent, DisplayName="Consac Twin"))
class CONSAC_API UConsacTwinComponent : public USceneComponent
{
	GENERATED_BODY()

public:
	UConsacTwinComponent();

	/** The robot, as an asset: drag twin.json into the Content Browser. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Twin")
	TObjectPtr<UConsacTwin> Twin;

	/** Without an asset: the twin.json that is read when it begins to play. A relative path is one below Saved/Consac of the project, which a packaged
	 *  game does not have. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Twin")
	FString Path;

	/** What its links look like; none: the frames alone, to which other components may be attached. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Twin")
	TArray<FConsacTwinMesh> Meshes;

	/** Who moves its joints; counts when it begins to play. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Twin")
	EConsacTwinMotion Motion = EConsacTwinMotion::Kinematic;

	/** With physics: how strongly a drive pulls, in N m per radian, or N per metre of a joint that slides; at most with the joint's effort. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Twin", meta=(ClampMin="0"))
	float DriveStiffness = 1000.0f;

	/** With physics: how strongly a drive brakes, in N m s per radian, or N s per metre; the joint's own damping is added. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Twin", meta=(ClampMin="0"))
	float DriveDamping = 100.0f;

	/** With physics: drives turn the other way. For an engine whose constraints count their target from the other body. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Twin")
	bool bReverseDrives = false;

	/** Becomes another robot, at once where it plays.
	 *  @param NewTwin The robot; none: nothing is left of the one before. */
	UFUNCTION(BlueprintCallable, Category="Consac|Twin", meta=(DisplayName="Set Twin"))
	void SetTwin(UConsacTwin* NewTwin);

	/** Brings a joint to a position, or to the limit that it would pass; joints that follow it move along. False, and a line in the log, when there is no
	 *  such joint, it is fixed or follows another, or the position is no number.
	 *  @param Position Degrees, or centimetres of a joint that slides. */
	UFUNCTION(BlueprintCallable, Category="Consac|Twin", meta=(DisplayName="Set Joint"))
	bool SetJoint(FName Joint, double Position);

	/** Where a joint is, in degrees or centimetres, one that follows another too; 0 when there is no such joint. */
	UFUNCTION(BlueprintPure, Category="Consac|Twin", meta=(DisplayName="Get Joint"))
	double GetJoint(FName Joint) const;

	/** Sets every joint that moves by itself, in the order of Get Joint Names. False, a line in the log and nothing is moved, when there are more or fewer
	 *  positions, or one is no number.
	 *  @param Positions Degrees, or centimetres of a joint that slides. */
	UFUNCTION(BlueprintCallable, Category="Consac|Twin", meta=(DisplayName="Set Pose"))
	bool SetPose(const TArray<double>& Positions);

	/** Where every joint that moves by itself is, in the order of Get Joint Names. */
	UFUNCTION(BlueprintCallable, BlueprintPure=false, Category="Consac|Twin", meta=(DisplayName="Get Pose"))
	TArray<double> GetPose() const;

	/** The joints that move by themselves; none before it begins to play. */
	UFUNCTION(BlueprintCallable, BlueprintPure=false, Category="Consac|Twin", meta=(DisplayName="Get Joint Names"))
	TArray<FName> GetJointNames() const;

	/** How far a joint goes. False, and 0, when there is no such joint, it is fixed, or it has no limits. */
	UFUNCTION(BlueprintCallable, BlueprintPure=false, Category="Consac|Twin", meta=(DisplayName="Get Joint Limits"))
	bool GetJointLimits(FName Joint, double& Lower, double& Upper) const;

	/** The links that carry no others. */
	UFUNCTION(BlueprintCallable, BlueprintPure=false, Category="Consac|Twin", meta=(DisplayName="Get End Effectors"))
	TArray<FName> GetEndEffectors() const;

	/** Where a link is, as seen from this component. False, and a line in the log, when there is no such link.
	 *  @param Link Its name; None for the first that carries no other. */
	UFUNCTION(BlueprintCallable, BlueprintPure=false, Category="Consac|Twin", meta=(DisplayName="Get End Effector"))
	bool GetEndEffector(FName Link, FTransform& Pose) const;

	/** What moves with a link, for whatever is to be attached to it; none when there is no such link. */
	UFUNCTION(BlueprintPure, Category="Consac|Twin", meta=(DisplayName="Get Link Component"))
	USceneComponent* GetLinkComponent(FName Link) const;

	virtual void BeginPlay() override;
	virtual void EndPlay(const EEndPlayReason::Type EndPlayReason) override;
	virtual void TickComponent(float DeltaTime, ELevelTick TickType, FActorComponentTickFunction* ThisTickFunction) override;
	virtual void BeginDestroy() override;

private:
	void Build();
	void Clear();
	void MoveJoints();
	void BuildBodies();
	void Constrain(int32 Joint);
	void DriveJoints();
	void ReadBodies();
	UPrimitiveComponent* BodyOf(int32 Link) const;
	UPrimitiveComponent* HolderOf(int32 Link) const;
	void Hang(const FConsacTwinMesh& Row);
	USceneComponent* Make(USceneComponent* Parent, const FString& Name);
	USceneComponent* MoverOf(int32 Joint) const;

	UPROPERTY(Transient, DuplicateTransient)
	TArray<TObjectPtr<USceneComponent>> Made;

	TPimplPtr<FConsacTwinState> State;
};
