// Copyright CONSAC authors. MIT License.
#include "ConsacCameraSensorComponent.h"

#include "Components/SceneCaptureComponent2D.h"
#include "Engine/TextureRenderTarget2D.h"
#include "ConsacCoreInclude.h"
#include "Kismet/KismetRenderingLibrary.h"
#include "Misc/App.h"
#include "RHICommandList.h"
#include "RenderingThread.h"
#include "TextureResource.h"
#include "UObject/UObjectGlobals.h"
#include "UObject/WeakObjectPtrTemplates.h"

namespace ConsacPlugin
{

// Cameras with a picture that is drawn and not read yet. Game thread.
static std::vector<TWeakObjectPtr<UConsacCameraSensorComponent>> Drawn;

// Points of a picture; none where there is no such picture: a graph may set any number.
static int32 PointsOf(int32 Width, int32 Height)
{
	constexpr int32 Longest = 1024;
	return Width > 0 && Height > 0 && Width <= Longest && Height <= Longest ? Width * Height : 0;
}

// A picture on its way from the graphics card.
struct FReading
{
	FTextureRenderTargetResource* From = nullptr;
	FIntRect Part;
	TArray<FColor> Colours;
};

}

UConsacCameraSensorComponent::UConsacCameraSensorComponent()
{
	ObservationName = FName(TEXT("camera"));
}

FConsacSpace UConsacCameraSensorComponent::GetSpace() const
{
	const int32 Channels = bGray ? 1 : 3;
	FConsacSpace Space;
	Space.Size = ConsacPlugin::PointsOf(Width, Height) * Channels; // 0 is refused
	Space.Shape.Add(Height);
	Space.Shape.Add(Width);
	Space.Shape.Add(Channels);
	Space.bBytes = true;
	return Space;
}

// A graph may set another size at any time: the picture is made anew.
void UConsacCameraSensorComponent::FitTarget()
{
	if (IsValid(Target.Get()) && Target->SizeX == Width && Target->SizeY == Height)
	{
		return;
	}
	bDrawn = bRead = false;
	Target = ConsacPlugin::PointsOf(Width, Height) > 0 ? UKismetRenderingLibrary::CreateRenderTarget2D(this, Width, Height, RTF_RGBA8) : nullptr;
	if (IsValid(Target.Get()))
	{
		Target->TargetGamma = 2.2f; // as on a screen; unless said it is linear, and too dark
	}
	Capture->TextureTarget = Target;
}

void UConsacCameraSensorComponent::BeginPlay()
{
	Capture = NewObject<USceneCaptureComponent2D>(this);
	Capture->SetupAttachment(this);
	Capture->bCaptureEveryFrame = false;
	Capture->bCaptureOnMovement = false;
	Capture->bAlwaysPersistRenderingState = true; // which the exposure is found in, over several pictures
	Capture->CaptureSource = SCS_FinalColorLDR;
	FitTarget();
	Capture->RegisterComponent();
	Super::BeginPlay();
}

// A level that is hidden and shown again begins to play anew.
void UConsacCameraSensorComponent::EndPlay(const EEndPlayReason::Type EndPlayReason)
{
	if (IsValid(Capture.Get()))
	{
		Capture->DestroyComponent();
	}
	Capture = nullptr;
	Target = nullptr;
	bDrawn = bRead = false;
	Super::EndPlay(EndPlayReason);
}

FString UConsacCameraSensorComponent::GetFault() const
{
	return FApp::CanEverRender() ? Super::GetFault()
		: FString(TEXT("this game draws nothing (-nullrhi, or a dedicated server), and a camera would see black; start it with -RenderOffscreen, or without the camera"));
}

void UConsacCameraSensorComponent::Prepare()
{
	if (IsValid(Capture.Get()))
	{
		FitTarget();
	}
	if (IsValid(Capture.Get()) && IsValid(Target.Get()))
	{
		Capture->CaptureScene();
		if (!bDrawn)
		{
			ConsacPlugin::Drawn.push_back(this);
		}
		bDrawn = true;
		bRead = false;
	}
}

// One command reads all pictures, and the game waits for that one.
void UConsacCameraSensorComponent::ReadAll()
{
	std::vector<UConsacCameraSensorComponent*> Cameras;
	std::vector<ConsacPlugin::FReading> Readings;
	for (const TWeakObjectPtr<UConsacCameraSensorComponent>& Asked : std::exchange(ConsacPlugin::Drawn, {}))
	{
		UConsacCameraSensorComponent* Camera = Asked.Get();
		if (!IsValid(Camera) || !Camera->bDrawn) // it has ended to play meanwhile
		{
			continue;
		}
		Camera->bDrawn = false;
		Camera->bRead = true;
		Camera->Colours.Reset();
		// A game without a picture (-nullrhi) has none to read.
		FTextureRenderTargetResource* From = FApp::CanEverRender() && IsValid(Camera->Target.Get()) ? Camera->Target->GameThread_GetRenderTargetResource() : nullptr;
		if (From != nullptr)
		{
			Cameras.push_back(Camera);
			Readings.push_back({ From, FIntRect(0, 0, Camera->Target->SizeX, Camera->Target->SizeY), TArray<FColor>() });
		}
	}
	if (Readings.empty())
	{
		return;
	}
	ENQUEUE_RENDER_COMMAND(ConsacReadCameras)([&Readings](FRHICommandListImmediate& Commands)
	{
		for (ConsacPlugin::FReading& Reading : Readings)
		{
			Commands.ReadSurfaceData(Reading.From->GetRenderTargetTexture(), Reading.Part, Reading.Colours, FReadSurfaceDataFlags());
		}
	});
	FlushRenderingCommands(); // what is above lives until the command is done
	for (std::size_t Index = 0; Index < Readings.size(); ++Index)
	{
		Cameras[Index]->Colours = MoveTemp(Readings[Index].Colours);
	}
}

void UConsacCameraSensorComponent::Sense(TArray<float>& Values)
{
	const int32 Points = ConsacPlugin::PointsOf(Width, Height);
	Values.Reset();
	if (IsValid(Capture.Get()))
	{
		FitTarget(); // of another size since it was drawn: what was drawn is no good
	}
	if (!bDrawn && !bRead)
	{
		Prepare();
	}
	if (bDrawn)
	{
		ReadAll();
	}
	const bool bSeen = bRead && Colours.Num() == Points;
	bRead = false;
	if (!bSeen)
	{
		// A game without a picture (-nullrhi) sees black.
		Values.SetNum(Points * (bGray ? 1 : 3));
		return;
	}
	Values.Reserve(Points * (bGray ? 1 : 3));
	for (const FColor& Colour : Colours)
	{
		const float Red = Colour.R, Green = Colour.G, Blue = Colour.B;
		if (bGray)
		{
			// Rec. 601, as most learning libraries turn pictures gray.
			Values.Add(0.299f * Red + 0.587f * Green + 0.114f * Blue);
		}
		else
		{
			Values.Add(Red);
			Values.Add(Green);
			Values.Add(Blue);
		}
	}
}
