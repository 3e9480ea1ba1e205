// The rest of the engine: frames, settings, files, programs, modules, tests.
#include <fcntl.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <map>
#include <set>

#include "Components/SceneCaptureComponent2D.h"
#include "Containers/Ticker.h"
#include "HAL/FileManager.h"
#include "HAL/IConsoleManager.h"
#include "HAL/PlatformProcess.h"
#include "Interfaces/IPluginManager.h"
#include "Kismet/KismetRenderingLibrary.h"
#include "Misc/App.h"
#include "Misc/AutomationTest.h"
#include "Misc/Parse.h"
#include "Misc/Paths.h"
#include "Modules/ModuleManager.h"
#include "PhysicsEngine/PhysicsSettings.h"
#include "RenderingThread.h"
#include "Shim/Runtime.h"
#include "Stats/Stats.h"
#include "UObject/UObjectGlobals.h"

FTSTicker& FTSTicker::GetCoreTicker() {
  static FTSTicker ticker;
  return ticker;
}

FTSTicker::FDelegateHandle FTSTicker::AddTicker(const FTickerDelegate& delegate, float delay) {
  shim_calls_.push_back(std::make_shared<FTickerDelegate>(delegate));
  shim_calls_.back()->shim_delay_ = delay;
  return shim_calls_.back();
}

void FTSTicker::RemoveTicker(FDelegateHandle handle) {
  std::erase(GetCoreTicker().shim_calls_, handle.lock());
}

void FTSTicker::ShimTick(float seconds) {
  const std::vector<std::shared_ptr<FTickerDelegate>> calls = shim_calls_;
  for (const std::shared_ptr<FTickerDelegate>& call : calls) {
    call->shim_waited_ += seconds;
    if (call->shim_waited_ < call->shim_delay_) continue;
    const float waited = std::exchange(call->shim_waited_, 0.0f);
    if ((call->shim_token_ != nullptr && *call->shim_token_ == nullptr) || !call->shim_call_(waited))
      std::erase(shim_calls_, call);
  }
}

IConsoleManager& IConsoleManager::Get() {
  static IConsoleManager manager;
  return manager;
}

IConsoleVariable* IConsoleManager::FindConsoleVariable(const TCHAR* name) {
  const auto found = shim_variables_.find(name);
  return found != shim_variables_.end() ? &found->second : nullptr;
}

UPhysicsSettings* UPhysicsSettings::Get() {
  static UPhysicsSettings settings;
  return &settings;
}

// Programs that were started and have not been seen to end.
static std::set<int>& ShimChildren() {
  static std::set<int> children;
  return children;
}

/// Whether it has ended; with `options` 0 it is waited for.
static bool ShimEnded(int child, int options) {
  return waitpid(child, nullptr, options) != 0;
}

void FPlatformProcess::ShimEndAll() {
  for (const int child : ShimChildren()) {
    kill(child, SIGKILL);
    ShimEnded(child, 0);
  }
  ShimChildren().clear();
}

FProcHandle FPlatformProcess::CreateProc(const TCHAR* url, const TCHAR* parameters, bool detached, bool, bool, uint32*,
                                         int32, const TCHAR*, void*, void*) {
  // Arguments in quotes or parted by spaces. How the engine takes its one line apart is its own affair on each system:
  // this one does so at spaces first, of which it then puts back one, and takes quotes off no word that does not need
  // them.
  const auto doubled = [](char a, char b) { return a == ' ' && b == ' '; };
  std::string line = Shim::Narrow(parameters) + " ";
  line.erase(std::unique(line.begin(), line.end(), doubled), line.end());
  std::vector<std::string> words{Shim::Narrow(url)};
  std::string word;
  bool quoted = false, any = false;
  for (const char c : line) {
    if (c == '"') {
      quoted = !quoted;
      any = true;
    } else if (c == ' ' && !quoted) {
      if (any && word.find_first_of(" \t") == std::string::npos) word = '"' + word + '"';
      if (!word.empty()) words.push_back(word);
      word.clear();
      any = false;
    } else {
      word += c;
    }
  }
  std::vector<char*> argv;
  for (std::string& text : words) argv.push_back(text.data());
  argv.push_back(nullptr);
  FProcHandle handle;
  std::fflush(nullptr);  // what is in buffers is not the program's to write
  handle.shim_detached_ = detached;
  posix_spawn_file_actions_t quiet;  // not fork: that copies a sanitizer's page tables each time
  posix_spawn_file_actions_init(&quiet);
  for (const int one : {STDOUT_FILENO, STDERR_FILENO}) {
    posix_spawn_file_actions_addopen(&quiet, one, "/dev/null", O_WRONLY, 0);
  }
  const bool started = posix_spawn(&handle.shim_child_, argv[0], &quiet, nullptr, argv.data(), environ) == 0;
  posix_spawn_file_actions_destroy(&quiet);
  if (!started) return FProcHandle();
  std::erase_if(ShimChildren(), [](int child) { return ShimEnded(child, WNOHANG); });
  ShimChildren().insert(handle.shim_child_);
  ++shim_open_;
  shim_latest_ = handle.shim_child_;
  return handle;
}

bool FPlatformProcess::IsProcRunning(FProcHandle& handle) {
  if (!ShimChildren().contains(handle.shim_child_)) return false;
  const bool ended = ShimEnded(handle.shim_child_, WNOHANG);
  if (ended) ShimChildren().erase(handle.shim_child_);
  return !ended;
}

void FPlatformProcess::TerminateProc(FProcHandle& handle, bool) {
  if (ShimChildren().contains(handle.shim_child_)) kill(handle.shim_child_, SIGTERM);
}

void FPlatformProcess::CloseProc(FProcHandle& handle) {
  shim_open_ -= handle.IsValid() ? 1 : 0;
  if (!handle.shim_detached_ && IsProcRunning(handle)) {
    ShimEnded(handle.shim_child_, 0);
    ShimChildren().erase(handle.shim_child_);
  }
  handle.shim_child_ = 0;
}

static std::string& ShimProject() {
  static std::string folder = ".";
  return folder;
}

void FPaths::ShimSetProject(const std::string& folder) {
  ShimProject() = folder;
}
FString FPaths::ProjectSavedDir() {
  return FString(Shim::Wide(ShimProject() + "/Saved/").c_str());
}
FString FPaths::ProjectContentDir() {
  return FString(Shim::Wide(ShimProject() + "/Content/").c_str());
}

FString FPaths::ConvertRelativePathToFull(const FString& path) {
  std::error_code error;
  return FString(Shim::Wide(std::filesystem::absolute(Shim::Narrow(*path), error).string()).c_str());
}

bool FPaths::FileExists(const FString& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(Shim::Narrow(*path), error);
}

IFileManager& IFileManager::Get() {
  static IFileManager manager;
  return manager;
}

bool IFileManager::MakeDirectory(const TCHAR* path, bool tree) {
  std::error_code error;
  const std::filesystem::path folder = Shim::Narrow(path);
  return tree ? std::filesystem::create_directories(folder, error) : std::filesystem::create_directory(folder, error);
}

void IFileManager::FindFiles(TArray<FString>& found, const TCHAR* folder, const TCHAR* ending) const {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(Shim::Narrow(folder), error)) {
    const std::string name = entry.path().filename().string();
    const bool fits = ending == nullptr || entry.path().extension().string() == "." + Shim::Narrow(ending);
    if (entry.is_regular_file(error) && fits) found.Add(FString(Shim::Wide(name).c_str()));
  }
}

void IFileManager::FindFilesRecursive(TArray<FString>& found, const TCHAR* folder, const TCHAR* name, bool files,
                                      bool folders, bool clear) const {
  check(files && !folders && name[0] == u'*');
  if (clear) found.Reset();
  std::error_code error;
  const std::filesystem::path root = Shim::Narrow(folder);
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root, error))
    if (entry.is_regular_file(error) && entry.path().extension().string() == Shim::Narrow(name + 1))
      found.Add(FString(Shim::Wide(entry.path().string()).c_str()));
}

FDateTime IFileManager::GetTimeStamp(const TCHAR* path) const {
  struct stat file;
  FDateTime time;
  if (stat(Shim::Narrow(path).c_str(), &file) == 0) time.shim_unix_ = static_cast<double>(file.st_mtime);
  return time;
}

int64 IFileManager::FileSize(const TCHAR* path) const {
  std::error_code error;
  const auto size = std::filesystem::file_size(Shim::Narrow(path), error);
  return error ? -1 : static_cast<int64>(size);
}

FDateTime FDateTime::UtcNow() {
  FDateTime time;
  time.shim_unix_ = static_cast<double>(std::time(nullptr));
  return time;
}

FString FDateTime::ToString(const TCHAR* format) const {
  const std::time_t seconds = static_cast<std::time_t>(shim_unix_);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[64];
  // The engine's minutes are %M and its months %m, as these.
  check(std::strftime(text, sizeof(text), Shim::Narrow(format).c_str(), &parts) > 0);
  return FString(Shim::Wide(text).c_str());
}

uint32 IFileManager::Copy(const TCHAR* to, const TCHAR* from) {
  std::error_code error;
  const auto how = std::filesystem::copy_options::overwrite_existing;
  return std::filesystem::copy_file(Shim::Narrow(from), Shim::Narrow(to), how, error) ? COPY_OK : COPY_Fail;
}

bool IFileManager::Delete(const TCHAR* path) {
  std::error_code error;
  return std::filesystem::remove(Shim::Narrow(path), error);
}

void FPaths::ShimAdd(std::u16string& whole, const FString& part) {
  if (!whole.empty() && whole.back() != u'/') whole += u'/';
  whole += *part;
}

bool FParse::Value(const TCHAR* stream, const TCHAR* match, FString& value) {
  const std::u16string_view all(stream);
  const std::size_t at = all.find(match);
  if (at == std::u16string_view::npos) return false;
  const std::size_t from = at + std::u16string_view(match).size();
  value = FString(std::u16string(all.substr(from, all.find(u' ', from) - from)).c_str());
  return true;
}

IPluginManager& IPluginManager::Get() {
  class Plugin final : public IPlugin {
   public:
    const FString& GetBaseDir() const override { return folder_; }

   private:
    FString folder_ = FString(Shim::Wide(ShimProject() + "/Plugins/Consac").c_str());
  };
  class Manager final : public IPluginManager {
   public:
    std::shared_ptr<IPlugin> FindPlugin(const FString& name) override {
      return name == FString(TEXT("Consac")) ? std::make_shared<Plugin>() : nullptr;
    }
  };
  static Manager manager;
  return manager;
}

UTextureRenderTarget2D* UKismetRenderingLibrary::CreateRenderTarget2D(UObject* context, int32 width, int32 height,
                                                                      ETextureRenderTargetFormat format) {
  check(context != nullptr && format == RTF_RGBA8);
  UTextureRenderTarget2D* target = NewObject<UTextureRenderTarget2D>(context);
  target->SizeX = width;
  target->SizeY = height;
  return target;
}

static std::vector<std::function<void(FRHICommandListImmediate&)>> render_commands;

void Shim::EnqueueRender(std::function<void(FRHICommandListImmediate&)> command) {
  check(FApp::CanEverRender());
  render_commands.push_back(std::move(command));
}

void FlushRenderingCommands() {
  FRHICommandListImmediate commands;
  for (const auto& command : std::exchange(render_commands, {})) command(commands);
  USceneCaptureComponent2D::shim_asked_ += 'W';
}

void FRHICommandListImmediate::ReadSurfaceData(FRHITexture* texture, FIntRect part, TArray<FColor>& colours,
                                               FReadSurfaceDataFlags) {
  const UTextureRenderTarget2D& target = *texture->shim_target_;
  check(part.shim_width_ == target.SizeX && part.shim_height_ == target.SizeY);
  USceneCaptureComponent2D::shim_asked_ += 'R';
  colours = target.shim_pixels_;
}

void USceneCaptureComponent2D::CaptureScene() {
  // A picture in which every point differs: red counts columns, green counts rows. It is too dark where the target's
  // gamma is not said, which then is linear, and where no view state is kept, in which the exposure is found.
  check(shim_begun_);
  UTextureRenderTarget2D& target = *TextureTarget;
  shim_asked_ += 'C';
  const bool seen = target.TargetGamma > 2.0f && (bCaptureEveryFrame || bAlwaysPersistRenderingState);
  const int32 dark = seen ? 1 : 2;
  target.shim_pixels_.Reset();
  for (int32 row = 0; row < target.SizeY; ++row) {
    for (int32 column = 0; column < target.SizeX; ++column) {
      FColor colour;
      colour.R = static_cast<uint8>(column / dark);
      colour.G = static_cast<uint8>(row / dark);
      colour.B = 0;
      target.shim_pixels_.Add(colour);
    }
  }
}

FAutomationTestBase::FAutomationTestBase(const char* shim_name) : shim_name_(shim_name) {
  ShimAll().push_back(this);
}

std::vector<FAutomationTestBase*>& FAutomationTestBase::ShimAll() {
  static std::vector<FAutomationTestBase*> all;
  return all;
}

void FAutomationTestBase::ShimRun() {
  shim_expected_.clear();
  Shim::ForgetLog();
  if (!RunTest(FString())) shim_failures_.push_back(FString(TEXT("it says itself that it failed")));
  for (const std::string& line : Shim::Log()) {
    if (line.find(": Error: ") == std::string::npos) continue;
    const FString text(Shim::Wide(line).c_str());
    const auto told = std::find_if(shim_expected_.begin(), shim_expected_.end(), [&](const ShimExpected& one) {
      return one.left > 0 && text.Contains(*one.pattern);
    });
    if (told == shim_expected_.end()) {
      shim_failures_.push_back(text);
    } else {
      --told->left;
    }
  }
  for (const ShimExpected& one : shim_expected_)
    if (one.left > 0) shim_failures_.push_back(FString::Printf(TEXT("the log never said '%s'"), *one.pattern));
}

namespace Shim {

static std::vector<IModuleInterface*>& Modules() {
  static std::vector<IModuleInterface*> modules;
  return modules;
}

int AddModule(const char*, IModuleInterface& module) {
  Modules().push_back(&module);
  return 0;
}

void StartModules() {
  for (IModuleInterface* module : Modules()) module->StartupModule();
}

void StopModules() {
  for (IModuleInterface* module : Modules()) module->ShutdownModule();
}

float& ShownStat(const TCHAR* name) {
  static std::map<std::u16string, float> shown;
  return shown[name];
}

}  // namespace Shim
