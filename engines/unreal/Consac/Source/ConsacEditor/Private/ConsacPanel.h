// Copyright CONSAC authors. MIT License.
// How the Consac panel is drawn: texts, buttons and a line. What they say is ConsacPanelState.h.
#pragma once

#include "CoreMinimal.h"
#include "ConsacCurve.h"
#include "Input/Reply.h"
#include "Layout/Geometry.h"
#include "Layout/SlateRect.h"
#include "Rendering/DrawElements.h"
#include "Styling/WidgetStyle.h"
#include "Templates/SharedPointer.h"
#include "Types/PaintArgs.h"
#include "Widgets/DeclarativeSyntaxSupport.h"
#include "Widgets/SCompoundWidget.h"
#include "Widgets/SLeafWidget.h"
#include "Widgets/Text/STextBlock.h"

class FConsacWatch;
struct FConsacPanelState;

/** The curve of mean reward over steps. */
class SConsacCurve : public SLeafWidget
{
public:
	SLATE_BEGIN_ARGS(SConsacCurve) {}
	SLATE_END_ARGS()

	void Construct(const FArguments& InArgs);
	void Show(const FConsacCurve& NewCurve);

	virtual int32 OnPaint(const FPaintArgs& Args, const FGeometry& AllottedGeometry, const FSlateRect& MyCullingRect, FSlateWindowElementList& OutDrawElements, int32 LayerId,
		const FWidgetStyle& InWidgetStyle, bool bParentEnabled) const override;
	virtual FVector2D ComputeDesiredSize(float LayoutScaleMultiplier) const override;

private:
	FConsacCurve Curve;
};

/** The panel. */
class SConsacPanel : public SCompoundWidget
{
public:
	SLATE_BEGIN_ARGS(SConsacPanel) {}
	SLATE_END_ARGS()

	void Construct(const FArguments& InArgs);

	/** Whom its buttons ask, which must outlive it or be taken away by null. */
	void Watch(FConsacWatch* NewWatch);

	/** Looks again. */
	void Refresh();

	/** Puts it into words, and draws its curve. */
	void Show(const FConsacPanelState& State);

private:
	FReply Start();
	FReply Stop();
	FReply StartProgram();
	FReply ImportModels();
	FReply Answer(const FString& Text);

	FConsacWatch* Watched = nullptr;
	TSharedPtr<SConsacCurve> Curve;
	TSharedPtr<STextBlock> AnswerText;
	TSharedPtr<STextBlock> StateText;
	TSharedPtr<STextBlock> CurveText;
	TSharedPtr<STextBlock> SpeedText;
	TSharedPtr<STextBlock> SlowText;
	TSharedPtr<STextBlock> ModelsText;
	TSharedPtr<STextBlock> FaultsText;
};
