#pragma once
/// A picture beside an entry; none.
struct FSlateIcon {};
