// Copyright CONSAC authors. MIT License.
// Watches what plays in the editor for the Consac panel, and starts and stops it.
#pragma once

#include "CoreMinimal.h"
#include "Components/ActorComponent.h"
#include "ConsacFrameClock.h"
#include "ConsacLogTail.h"
#include "ConsacPanelState.h"
#include "UObject/Object.h"
#include "UObject/WeakObjectPtrTemplates.h"

class AConsacTrainer;
class UWorld;

/** Hears the log and every frame from its making on, so that the panel's curve is there when it is opened in the middle of a training. */
class FConsacWatch
{
public:
	FConsacWatch();
	~FConsacWatch();
	FConsacWatch(const FConsacWatch&) = delete;
	FConsacWatch& operator=(const FConsacWatch&) = delete;

	/** What there is now. To be called a few times a second.
	 *  @param bModels Also look for models' files, every few seconds. */
	const FConsacPanelState& Look(bool bModels);

	/** Each of these acts on the Consac Trainer that drives, in every world that plays here, and says in words what came of it. */
	FString Start();
	FString Stop();
	FString StartProgram();
	FString ImportModels();

private:
	void BeginWorld(UWorld* World, ELevelTick TickType, float DeltaSeconds);
	void EndWorld(UWorld* World, ELevelTick TickType, float DeltaSeconds);
	void EndFrame();
	void LookAtTrainers();
	void LookForModels();
	TArray<AConsacTrainer*> Driving(FString& Why) const;

	FConsacLogTail Log;
	FConsacFrameClock Clock;
	FConsacPanelState State;
	TWeakObjectPtr<UObject> First; // whose curve it is
	double ModelsAt = 0.0;         // when files were looked for
	bool bModelsKnown = false;
	FDelegateHandle WorldBegins;
	FDelegateHandle WorldEnds;
	FDelegateHandle FrameEnds;
};
