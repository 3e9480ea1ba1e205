#pragma once
/// Colours that a widget has of those around it.
class FWidgetStyle {};
