// Windows: a section of the session's namespace with a name that nobody guesses, kept by the default rights for this
// user only; its size cannot change. A reader sleeps on an event named after the section and the word's offset
// (WaitOnAddress does not cross processes).
#include "transport/shared_memory_ways.h"

#if CONSAC_SHARED_SECTION

#if !defined(WIN32_LEAN_AND_MEAN)
#define WIN32_LEAN_AND_MEAN
#endif
#if !defined(NOMINMAX)
#define NOMINMAX
#endif
#include <windows.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/entropy.h"

namespace consac {
namespace {

constexpr char kSectionPrefix[] = "Local\\consac-";
constexpr std::size_t kSectionSecret = 16;  // bytes

Status SectionError(const std::string& what) {
  return {StatusCode::kUnavailable, what + ": Windows error " + std::to_string(GetLastError())};
}

class SectionRegion final : public SharedRegion {
 public:
  static Result<std::unique_ptr<SharedRegion>> Make(std::size_t bytes) {
    std::unique_ptr<SectionRegion> region(new SectionRegion);
    const std::string secret = UnguessableHex(kSectionSecret);
    if (secret.empty())
      return Status{StatusCode::kUnavailable, "the system has no randomness to name shared memory by"};
    region->path_ = kSectionPrefix + secret;
    const auto wide = static_cast<std::uint64_t>(bytes);
    SetLastError(ERROR_SUCCESS);
    region->section_ = CreateFileMappingA(INVALID_HANDLE_VALUE, nullptr, PAGE_READWRITE, static_cast<DWORD>(wide >> 32),
                                          static_cast<DWORD>(wide), region->path_.c_str());
    if (region->section_ == nullptr || GetLastError() == ERROR_ALREADY_EXISTS)
      return SectionError("cannot make shared memory of " + std::to_string(bytes) + " bytes");
    if (!region->Map(bytes)) return SectionError("cannot map shared memory");
    return std::unique_ptr<SharedRegion>(std::move(region));
  }

  static Result<std::unique_ptr<SharedRegion>> OpenPath(const std::string& path, std::size_t bytes) {
    // Somebody else's text: nothing but such a name is opened.
    const std::string_view name = path;
    const std::size_t length = sizeof(kSectionPrefix) - 1;
    if (!name.starts_with(kSectionPrefix) || name.size() != length + 2 * kSectionSecret ||
        name.find_first_not_of("0123456789abcdef", length) != std::string_view::npos) {
      return Status{StatusCode::kDataLoss, "'" + path + "' is no shared memory; expected Local\\consac-NUMBER"};
    }
    std::unique_ptr<SectionRegion> region(new SectionRegion);
    region->path_ = path;
    region->section_ = OpenFileMappingA(FILE_MAP_READ | FILE_MAP_WRITE, FALSE, path.c_str());
    if (region->section_ == nullptr) return SectionError("cannot open the shared memory '" + path + "'");
    // A view cannot be larger than its section.
    if (!region->Map(bytes)) {
      return Status{StatusCode::kDataLoss,
                    "the shared memory '" + path + "' is smaller than " + std::to_string(bytes) + " bytes"};
    }
    return std::unique_ptr<SharedRegion>(std::move(region));
  }

  ~SectionRegion() override {
    for (const Event& event : events_) CloseHandle(event.handle);
    if (data_ != nullptr) UnmapViewOfFile(data_);
    if (section_ != nullptr) CloseHandle(section_);
  }

  void SleepOn(std::size_t offset, std::uint32_t, double seconds) override {
    constexpr double kLongest = 1e6;  // s
    const double milliseconds = std::ceil(std::clamp(seconds, 0.0, kLongest) * 1e3);
    const HANDLE event = EventAt(offset);
    if (event != nullptr) {
      (void)WaitForSingleObject(event, static_cast<DWORD>(milliseconds));
    } else {
      Sleep(1);
    }
  }
  void Wake(std::size_t offset) override {
    const HANDLE event = EventAt(offset);
    if (event != nullptr) (void)SetEvent(event);
  }

 private:
  struct Event {
    std::size_t offset = 0;
    HANDLE handle = nullptr;
  };

  SectionRegion() = default;

  bool Map(std::size_t bytes) {
    data_ = static_cast<std::byte*>(MapViewOfFile(section_, FILE_MAP_READ | FILE_MAP_WRITE, 0, 0, bytes));
    size_ = data_ != nullptr ? bytes : 0;
    return data_ != nullptr;
  }

  /// The event of a word, made by whichever end needs it first. It resets itself when it has woken its reader, and
  /// stays set when that does not sleep yet.
  HANDLE EventAt(std::size_t offset) {
    for (const Event& event : events_) {
      if (event.offset == offset) return event.handle;
    }
    const HANDLE handle = CreateEventA(nullptr, FALSE, FALSE, (path_ + "-" + std::to_string(offset)).c_str());
    if (handle != nullptr) events_.push_back({offset, handle});
    return handle;
  }

  HANDLE section_ = nullptr;
  std::vector<Event> events_;
};

}  // namespace

const SharedMemoryWay kSectionWay = {"section", SectionRegion::Make, SectionRegion::OpenPath};

}  // namespace consac

#endif
