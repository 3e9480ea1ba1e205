#include "report/monitor_csv.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "consac/base/json.h"
#include "consac/learn/log/row.h"

namespace consac::run {
namespace {

// Python's round(value, 6), but for values so large that they have no sixth decimal.
double RoundedToMicro(double value) {
  return std::fabs(value) < 1e9 ? std::round(value * 1e6) / 1e6 : value;
}

}  // namespace

Result<std::unique_ptr<MonitorCsv>> MonitorCsv::Open(const std::string& path, const std::string& world_id,
                                                     double start_time, learn::OpenMode mode) {
  Result<std::unique_ptr<learn::OutputFile>> file = learn::OutputFile::Open(path, mode);
  if (!file.ok()) return file.status();
  if ((*file)->size() == 0) {
    const nlohmann::ordered_json header = {{"t_start", start_time}, {"env_id", world_id}};
    (*file)->Append("#" + AsciiJsonText(header) + "\nr,l,t\n");
    (*file)->Flush();
  }
  return std::unique_ptr<MonitorCsv>(new MonitorCsv(std::move(*file)));
}

void MonitorCsv::Append(double reward, std::int64_t length, double seconds) {
  char first[32], last[32];
  fmt::memory_buffer line;
  fmt::format_to(std::back_inserter(line), "{},{},{}\n", learn::ExactText(RoundedToMicro(reward), first), length,
                 learn::ExactText(RoundedToMicro(seconds), last));
  file_->Append({line.data(), line.size()});
}

void MonitorCsv::Visit(Archive& archive) {
  Flush();
  std::vector<std::uint64_t> end = {file_->size(), file_->lines()};  // checkpoints of before 2026-11-23 have no lines
  archive("bytes", end);
  if (!archive.loading() || !archive.status().ok()) return;
  archive.Check("bytes", end.size() == 1 || end.size() == 2);
  if (!archive.status().ok()) return;
  Status cut = end.size() == 1 ? file_->CutToLine(end[0]) : Status::Ok();
  if (cut.ok()) cut = file_->CutAfterLines(end.size() == 1 ? std::numeric_limits<std::uint64_t>::max() : end[1]);
  if (!cut.ok()) archive.Refuse(std::move(cut));
}

}  // namespace consac::run
