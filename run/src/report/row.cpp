#include "report/row.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace consac::run {
namespace {

template <class Float>
void AppendShortest(Float value, fmt::memory_buffer* out) {
  const std::size_t begin = out->size();
  fmt::format_to(std::back_inserter(*out), "{}", value);
  const std::string_view digits(out->data() + begin, out->size() - begin);
  if (digits.find_first_not_of("-0123456789") == std::string_view::npos) out->append(std::string_view(".0"));
}

}  // namespace

void AppendExact(double value, fmt::memory_buffer* out) {
  AppendShortest(value, out);
}

std::string ExactText(const Cell& cell) {
  if (cell.kind == CellKind::kInteger) return fmt::format("{:.0f}", std::trunc(cell.value) + 0.0);
  fmt::memory_buffer text;
  if (cell.kind == CellKind::kSingle) {
    AppendShortest(static_cast<float>(cell.value), &text);
  } else {
    AppendShortest(cell.value, &text);
  }
  return fmt::to_string(text);
}

std::string TableText(const Cell& cell) {
  return cell.kind == CellKind::kDouble ? fmt::format("{:<8.3g}", cell.value) : ExactText(cell);
}

}  // namespace consac::run
