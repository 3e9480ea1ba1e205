#pragma once
// Text from outside: from a peer, a model file, a checkpoint, a designer. This is the one place that makes of it a name
// (checked), a file's or folder's name (never a path) or a line for people. tools/check_text.py holds everything else
// to that; the rules in words: spec/names.md.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "consac/base/status.h"

namespace consac {

/// Bytes of the longest name.
inline constexpr std::size_t kLongestName = 255;
/// Bytes of the longest folder's name.
inline constexpr std::size_t kLongestFolder = 128;

/// Ok for a name: 1 to 255 bytes of UTF-8 that PrintableLine leaves as they are. `what` begins the error, "behaviour".
Status CheckName(std::string_view what, std::string_view name);
/// The same for a name that may be missing ("").
Status CheckOptionalName(std::string_view what, std::string_view name);
/// Ok for names of which no two are the same: a world's agents. `what` is of one of them. Cost: n log n.
Status CheckNamesApart(std::string_view what, std::span<const std::string> names);
/// Ok for names that stand beside each other and may become files: no two the same, nor told apart by capitals alone,
/// and where there are several, none too long for a file's name. `what` is of one of them.
Status CheckNamesTogether(std::string_view what, std::span<const std::string_view> names);

/// Ok for what becomes a folder as it is, on every system: at most 128 letters, digits, '_', '-' and '.' without a dot
/// at either end, and no device of Windows.
Status CheckFolderName(std::string_view what, std::string_view name);
/// Some text as a folder's name: every byte that CheckFolderName refuses becomes '_', and what goes beyond `most` bytes
/// (1 at least) is left out. Not injective; "" becomes "_".
std::string AsFolderName(std::string_view text, std::size_t most = kLongestFolder);
/// The file for a checked name: letters, digits, '_', '-', '.' and blanks inside stand for themselves, every other byte
/// is %XX, and so is the first of what Windows takes for a device. Different names have different files; where capitals
/// do not count, see CheckNamesTogether. Never a path. `extension` is ours: ".consac".
std::string FileNameOf(std::string_view name, std::string_view extension);

/// As much of `text` as `most` bytes hold without a part of a UTF-8 character.
std::string_view CutAtCharacter(std::string_view text, std::size_t most);
/// `text` as one line: UTF-8 that shows stays; control characters (line ends and escape too), what turns the direction
/// of writing, what shows nothing and bytes that are no UTF-8 become \xNN, byte by byte. Cost: one pass.
std::string PrintableLine(std::string text);
/// The same, but line ends stay: for text of several lines that was made here, such as a table.
std::string PrintableText(std::string text);

}  // namespace consac
