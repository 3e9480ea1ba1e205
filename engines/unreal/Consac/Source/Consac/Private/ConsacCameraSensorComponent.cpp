// Copyright CONSAC authors. MIT License.
#include "ConsacCameraSensorComponent.h"

#include "Components/SceneCaptureComponent2D.h"
#include "Engine/TextureRenderTarget2D.h"
#include "Kismet/KismetRenderingLibrary.h"
#include "UObject/UObjectGlobals.h"

UConsacCameraSensorComponent::UConsacCameraSensorComponent()
{
	ObservationName = FName(TEXT("camera"));
}

FConsacSpace UConsacCameraSensorComponent::GetSpace() const
{
	const int32 Channels = bGray ? 1 : 3;
	FConsacSpace Space;
	Space.Size = Width * Height * Channels;
	Space.Shape.Add(Height);
	Space.Shape.Add(Width);
	Space.Shape.Add(Channels);
	Space.bBytes = true;
	return Space;
}

void UConsacCameraSensorComponent::BeginPlay()
{
	Target = UKismetRenderingLibrary::CreateRenderTarget2D(this, Width, Height, RTF_RGBA8);
	Capture = NewObject<USceneCaptureComponent2D>(this);
	Capture->SetupAttachment(this);
	Capture->bCaptureEveryFrame = false;
	Capture->bCaptureOnMovement = false;
	Capture->CaptureSource = SCS_FinalColorLDR;
	Capture->TextureTarget = Target;
	Capture->RegisterComponent();
	Super::BeginPlay();
}

void UConsacCameraSensorComponent::Prepare()
{
	if (IsValid(Capture.Get()) && IsValid(Target.Get()))
	{
		Capture->CaptureScene();
		bDrawn = true;
	}
}

void UConsacCameraSensorComponent::Sense(TArray<float>& Values)
{
	const int32 Points = Width * Height;
	Values.Reset();
	TArray<FColor> Colours;
	if (!bDrawn)
	{
		Prepare();
	}
	if (bDrawn && IsValid(Target.Get()))
	{
		UKismetRenderingLibrary::ReadRenderTarget(this, Target.Get(), Colours);
	}
	bDrawn = false;
	if (Colours.Num() != Points)
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
