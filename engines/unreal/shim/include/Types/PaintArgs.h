#pragma once
/// Of whom a widget is painted, and when.
class FPaintArgs {};
