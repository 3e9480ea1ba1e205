#include "report/text_files.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>

#include "consac/base/file.h"
#include "consac/base/text.h"

namespace consac::run {
namespace {

std::vector<std::string> SplitLine(const std::string& line) {
  std::vector<std::string> cells;
  std::size_t begin = 0;
  while (true) {
    const std::size_t comma = line.find(',', begin);
    cells.push_back(line.substr(begin, comma - begin));
    if (comma == std::string::npos) return cells;
    begin = comma + 1;
  }
}

std::string JoinLine(const std::vector<std::string>& cells) {
  std::string line;
  for (std::size_t i = 0; i < cells.size(); ++i) line += (i > 0 ? "," : "") + cells[i];
  return line + "\n";
}

std::string NumberCell(const Cell& cell) {
  if (std::isnan(cell.value)) return "nan";
  if (cell.whole) return std::to_string(static_cast<std::int64_t>(cell.value));
  return NumberText(cell.value);
}

}  // namespace

LineFile::~LineFile() {
  if (file_ != nullptr) std::fclose(file_);
}

Status LineFile::Open(const std::string& path, bool append) {
  if (file_ != nullptr) std::fclose(file_);
  path_ = path;
  file_ = std::fopen(path.c_str(), append ? "ab" : "wb");
  status_ = file_ != nullptr ? Status::Ok() : Status{StatusCode::kUnavailable, "cannot open '" + path + "': " + std::strerror(errno)};
  return status_;
}

void LineFile::Write(std::string_view text) {
  if (file_ == nullptr || !status_.ok()) return;
  if (std::fwrite(text.data(), 1, text.size(), file_) != text.size()) {
    status_ = {StatusCode::kResourceExhausted, "cannot write '" + path_ + "': " + std::strerror(errno)};
  }
}

void LineFile::Flush() {
  if (file_ == nullptr || !status_.ok()) return;
  if (std::fflush(file_) != 0) status_ = {StatusCode::kResourceExhausted, "cannot write '" + path_ + "': " + std::strerror(errno)};
}

Status ProgressCsv::Open(const std::string& path, const std::string& step_key, bool append, std::int64_t last_step) {
  path_ = path;
  if (append) {
    std::ifstream old(path);
    std::string line;
    if (std::getline(old, line)) columns_ = SplitLine(line);
    const auto step = std::find(columns_.begin(), columns_.end(), step_key);
    const auto step_column = static_cast<std::size_t>(step - columns_.begin());
    while (std::getline(old, line)) {
      std::vector<std::string> cells = SplitLine(line);
      std::int64_t at = 0;
      const bool whole = cells.size() == columns_.size() && step != columns_.end() && ParseNumber(cells[step_column], &at);
      if (whole && at <= last_step) rows_.push_back(std::move(cells));
    }
  }
  CONSAC_RETURN_IF_ERROR(file_.Open(path, false));
  if (!columns_.empty()) Rewrite();
  return file_.status();
}

void ProgressCsv::Rewrite() {
  if (!file_.Open(path_, false).ok()) return;
  file_.Write(JoinLine(columns_));
  for (std::vector<std::string>& row : rows_) {
    row.resize(columns_.size());
    file_.Write(JoinLine(row));
  }
}

void ProgressCsv::Add(const Cells& cells) {
  const std::size_t before = columns_.size();
  for (const auto& [key, cell] : cells) {
    if (std::find(columns_.begin(), columns_.end(), key) == columns_.end()) columns_.push_back(key);
  }
  std::vector<std::string> row;
  for (const std::string& column : columns_) {
    const auto cell = cells.find(column);
    row.push_back(cell == cells.end() ? "" : NumberCell(cell->second));
  }
  rows_.push_back(std::move(row));
  if (columns_.size() != before) Rewrite();
  else file_.Write(JoinLine(rows_.back()));
}

Status TruncateMonitor(const std::string& path, std::int64_t rows) {
  std::ifstream old(path);
  std::string line, kept;
  constexpr std::int64_t kHeaderLines = 2;
  for (std::int64_t i = 0; i < kHeaderLines + rows && std::getline(old, line); ++i) kept += line + "\n";
  return WriteFileAtomically(path, std::as_bytes(std::span(kept)));
}

}  // namespace consac::run
