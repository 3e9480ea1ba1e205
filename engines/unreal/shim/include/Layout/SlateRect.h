#pragma once
/// A part of the screen.
class FSlateRect {};
