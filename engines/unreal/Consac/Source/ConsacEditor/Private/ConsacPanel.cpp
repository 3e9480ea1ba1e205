// Copyright CONSAC authors. MIT License.
#include "ConsacPanel.h"

#include "ConsacPanelState.h"
#include "ConsacWatch.h"
#include "Widgets/Input/SButton.h"
#include "Widgets/Layout/SScrollBox.h"
#include "Widgets/SBoxPanel.h"

void SConsacCurve::Construct(const FArguments&)
{
}

void SConsacCurve::Show(const FConsacCurve& NewCurve)
{
	Curve = NewCurve;
}

int32 SConsacCurve::OnPaint(const FPaintArgs&, const FGeometry& AllottedGeometry, const FSlateRect&, FSlateWindowElementList& OutDrawElements, int32 LayerId,
	const FWidgetStyle&, bool) const
{
	const FVector2f Size = AllottedGeometry.GetLocalSize();
	TArray<FVector2f> Sides;
	Sides.Add(FVector2f(0.0f, 0.0f));
	Sides.Add(FVector2f(0.0f, Size.Y));
	Sides.Add(FVector2f(Size.X, Size.Y));
	FSlateDrawElement::MakeLines(OutDrawElements, static_cast<uint32>(LayerId), AllottedGeometry.ToPaintGeometry(), Sides, ESlateDrawEffect::None, FLinearColor(0.4f, 0.4f, 0.4f), true, 1.0f);
	const TArray<FVector2f> Line = Curve.InPicture(Size.X, Size.Y);
	if (Line.Num() >= 2)
	{
		FSlateDrawElement::MakeLines(OutDrawElements, static_cast<uint32>(LayerId + 1), AllottedGeometry.ToPaintGeometry(), Line, ESlateDrawEffect::None, FLinearColor(0.1f, 0.7f, 0.3f), true, 2.0f);
	}
	return LayerId + 1;
}

FVector2D SConsacCurve::ComputeDesiredSize(float) const
{
	return FVector2D(320.0, 140.0);
}

void SConsacPanel::Construct(const FArguments&)
{
	constexpr float Room = 4.0f;
	ChildSlot
	[
		SNew(SScrollBox)
		+ SScrollBox::Slot()
		[
			SNew(SVerticalBox)
			+ SVerticalBox::Slot().AutoHeight().Padding(Room)
			[
				SNew(SHorizontalBox)
				+ SHorizontalBox::Slot().AutoWidth().Padding(Room)
				[
					SNew(SButton).Text(FText::FromString(TEXT("Start"))).ToolTipText(FText::FromString(TEXT("Start Training of the Consac Trainer that plays"))).OnClicked(this, &SConsacPanel::Start)
				]
				+ SHorizontalBox::Slot().AutoWidth().Padding(Room)
				[
					SNew(SButton).Text(FText::FromString(TEXT("Stop"))).ToolTipText(FText::FromString(TEXT("Stop Training: what was learned is saved in Save Folder"))).OnClicked(this, &SConsacPanel::Stop)
				]
				+ SHorizontalBox::Slot().AutoWidth().Padding(Room)
				[
					SNew(SButton).Text(FText::FromString(TEXT("Start Program"))).ToolTipText(FText::FromString(TEXT("Starts the program consac, to train a Consac Trainer whose Mode is Serve"))).OnClicked(this, &SConsacPanel::StartProgram)
				]
				+ SHorizontalBox::Slot().AutoWidth().Padding(Room)
				[
					SNew(SButton).Text(FText::FromString(TEXT("Import Models"))).ToolTipText(FText::FromString(TEXT("Trained models become assets below Content/Consac"))).OnClicked(this, &SConsacPanel::ImportModels)
				]
			]
			+ SVerticalBox::Slot().AutoHeight().Padding(Room)
			[
				SAssignNew(AnswerText, STextBlock).AutoWrapText(true)
			]
			+ SVerticalBox::Slot().AutoHeight().Padding(Room)
			[
				SAssignNew(StateText, STextBlock).AutoWrapText(true)
			]
			+ SVerticalBox::Slot().AutoHeight().Padding(Room)
			[
				SAssignNew(CurveText, STextBlock).AutoWrapText(true)
			]
			+ SVerticalBox::Slot().AutoHeight().Padding(Room)
			[
				SAssignNew(Curve, SConsacCurve)
			]
			+ SVerticalBox::Slot().AutoHeight().Padding(Room)
			[
				SAssignNew(SpeedText, STextBlock).AutoWrapText(true)
			]
			+ SVerticalBox::Slot().AutoHeight().Padding(Room)
			[
				SAssignNew(SlowText, STextBlock).AutoWrapText(true)
			]
			+ SVerticalBox::Slot().AutoHeight().Padding(Room)
			[
				SAssignNew(FaultsText, STextBlock).AutoWrapText(true)
			]
			+ SVerticalBox::Slot().AutoHeight().Padding(Room)
			[
				SAssignNew(ModelsText, STextBlock).AutoWrapText(true)
			]
		]
	];
}

void SConsacPanel::Watch(FConsacWatch* NewWatch)
{
	Watched = NewWatch;
}

void SConsacPanel::Refresh()
{
	if (Watched != nullptr)
	{
		Show(Watched->Look(true));
	}
}

void SConsacPanel::Show(const FConsacPanelState& State)
{
	StateText->SetText(FText::FromString(ConsacPanelWords::State(State)));
	CurveText->SetText(FText::FromString(ConsacPanelWords::Curve(State)));
	SpeedText->SetText(FText::FromString(ConsacPanelWords::Speed(State)));
	SlowText->SetText(FText::FromString(ConsacPanelWords::Slow(State)));
	ModelsText->SetText(FText::FromString(ConsacPanelWords::Models(State)));
	FaultsText->SetText(FText::FromString(ConsacPanelWords::Faults(State)));
	Curve->Show(State.Curve);
}

FReply SConsacPanel::Start()
{
	return Watched != nullptr ? Answer(Watched->Start()) : FReply::Handled();
}

FReply SConsacPanel::Stop()
{
	return Watched != nullptr ? Answer(Watched->Stop()) : FReply::Handled();
}

FReply SConsacPanel::StartProgram()
{
	return Watched != nullptr ? Answer(Watched->StartProgram()) : FReply::Handled();
}

FReply SConsacPanel::ImportModels()
{
	return Watched != nullptr ? Answer(Watched->ImportModels()) : FReply::Handled();
}

FReply SConsacPanel::Answer(const FString& Text)
{
	AnswerText->SetText(FText::FromString(Text));
	Refresh();
	return FReply::Handled();
}
