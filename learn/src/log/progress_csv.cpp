#include "consac/learn/log/progress_csv.h"

#include <algorithm>
#include <span>
#include <string_view>

#include "consac/base/file.h"
#include "consac/base/text.h"

namespace consac::learn {
namespace {

constexpr std::size_t kMostRewritten = std::size_t{256} << 20;  // bytes; a longer file gets no further columns

std::vector<std::string> SplitFields(std::string_view line) {
  std::vector<std::string> fields;
  for (std::size_t comma = 0; comma != std::string_view::npos; line.remove_prefix(comma + 1)) {
    comma = line.find(',');
    fields.emplace_back(line.substr(0, comma));
    if (comma == std::string_view::npos) break;
  }
  return fields;
}

std::string JoinFields(const std::vector<std::string>& fields) {
  std::string line;
  for (std::size_t i = 0; i < fields.size(); ++i) line += (i == 0 ? "" : ",") + fields[i];
  return line;
}

std::string_view WithoutReturn(std::string_view line) {
  return line.ends_with('\r') ? line.substr(0, line.size() - 1) : line;
}

// Whole lines without their ends; what follows the last newline was cut off by a kill and is dropped.
Result<std::vector<std::string>> ReadLines(const std::string& path) {
  Result<std::vector<std::byte>> bytes = ReadRegularFile(path, kMostRewritten);
  if (!bytes.ok()) return bytes.status();
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  std::vector<std::string> lines;
  std::size_t begin = 0;
  for (std::size_t end = text.find('\n'); end != std::string_view::npos; end = text.find('\n', begin)) {
    lines.emplace_back(WithoutReturn(text.substr(begin, end - begin)));
    begin = end + 1;
  }
  return lines;
}

std::string JoinLines(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text.append(line).push_back('\n');
  return text;
}

// True for a row that the resumed run will write again.
bool IsPast(std::string_view line, std::size_t column, std::int64_t last_step) {
  const std::vector<std::string> fields = SplitFields(line);
  double step = 0.0;
  return column < fields.size() && ParseNumber(fields[column], &step) && step > static_cast<double>(last_step);
}

}  // namespace

ProgressCsv::ProgressCsv(std::vector<std::string> columns, std::unique_ptr<OutputFile> file)
    : columns_(std::move(columns)), file_(std::move(file)) {}

// Rows are in the order of their steps: those that come again are at the end, and only that is read.
Result<std::unique_ptr<ProgressCsv>> ProgressCsv::Open(const std::string& path, const Resume& resume) {
  Result<std::unique_ptr<OutputFile>> file =
      OutputFile::Open(path, resume.append ? OpenMode::kAppend : OpenMode::kTruncate);
  if (!file.ok()) return file.status();
  std::vector<std::string> columns;
  CONSAC_RETURN_IF_ERROR((*file)->CutToLine((*file)->size()));
  if ((*file)->size() > 0) {
    const Result<std::string> header = (*file)->FirstLine();
    if (!header.ok()) return header.status();
    columns = SplitFields(WithoutReturn(*header));
    const auto found = std::find(columns.begin(), columns.end(), resume.step_column);
    const auto column = static_cast<std::size_t>(found - columns.begin());
    CONSAC_RETURN_IF_ERROR((*file)->CutLinesWhile(
        [&](std::string_view line) { return IsPast(WithoutReturn(line), column, resume.last_step); }));
  }
  return std::unique_ptr<ProgressCsv>(new ProgressCsv(std::move(columns), std::move(*file)));
}

void ProgressCsv::Append(const Row& row) {
  if (!AddColumns(row)) return;
  std::vector<std::string> fields(columns_.size());
  for (const Cell& cell : row) {
    const auto column = std::find(columns_.begin(), columns_.end(), cell.key);
    fields[static_cast<std::size_t>(column - columns_.begin())] = ExactText(cell);
  }
  file_->Append(JoinFields(fields) + '\n');
  file_->Flush();
}

// False when the file could not be rewritten; its columns are then as before.
bool ProgressCsv::AddColumns(const Row& row) {
  std::vector<std::string> columns = columns_;
  for (const Cell& cell : row) {
    if (std::find(columns.begin(), columns.end(), cell.key) == columns.end()) columns.emplace_back(cell.key);
  }
  if (columns.size() == columns_.size()) return true;
  Result<std::vector<std::string>> lines = ReadLines(file_->path());
  Status failure = lines.status();
  if (lines.ok()) {
    if (lines->empty()) lines->emplace_back();
    const std::string padding(columns.size() - columns_.size(), ',');
    for (std::string& line : *lines) line += padding;
    lines->front() = JoinFields(columns);
    failure = file_->Replace(JoinLines(*lines));
  }
  if (failure.ok()) columns_ = std::move(columns);
  if (status_.ok()) status_ = failure;
  return failure.ok();
}

}  // namespace consac::learn
