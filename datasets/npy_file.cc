#include "datasets/npy_file.h"

#include <bit>
#include <cstring>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "datasets/output_folder.h"
#include "datasets/python_literal.h"
#include "solvers/residuals.h"

namespace crumple {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

constexpr std::size_t preamble_size = 10;  // magic, version, length of the header
const std::string magic("\x93NUMPY\x01\x00", 8);

struct Layout {
  std::size_t rows = 0;
  std::size_t columns = 0;
  bool column_major = false;
};

Expected<Layout> read_layout(const std::string& header) {
  const auto fields = parse_python_literal(header);
  if (!fields) return tl::unexpected(fields.error());
  if (!fields->is_object() || fields->value("descr", nlohmann::json()) != "<f8")
    return fail("its numbers are not little-endian float64 (descr '<f8')");
  const nlohmann::json shape = fields->value("shape", nlohmann::json());
  const nlohmann::json fortran = fields->value("fortran_order", nlohmann::json());
  const auto is_count = [](const nlohmann::json& n) { return n.is_number_integer() && n.get<long long>() >= 0; };
  if (!shape.is_array() || shape.size() != 2 || !is_count(shape[0]) || !is_count(shape[1]) || !fortran.is_boolean())
    return fail("it does not hold a matrix with two dimensions");
  return Layout{shape[0].get<std::size_t>(), shape[1].get<std::size_t>(), fortran.get<bool>()};
}

}  // namespace

Expected<Eigen::MatrixXd> parse_npy(const std::string& bytes) {
  if (bytes.size() < preamble_size || bytes.compare(0, magic.size(), magic) != 0)
    return fail("it is not a .npy file of version 1.0");
  const std::size_t header_size = static_cast<unsigned char>(bytes[8]) + 256U * static_cast<unsigned char>(bytes[9]);
  if (bytes.size() < preamble_size + header_size) return fail("it is cut short");
  const auto layout = read_layout(bytes.substr(preamble_size, header_size));
  if (!layout) return tl::unexpected(layout.error());
  const std::size_t available = (bytes.size() - preamble_size - header_size) / sizeof(double);
  const bool sane = layout->rows < (1U << 20) && layout->columns < (1U << 20);
  if (!sane || bytes.size() != preamble_size + header_size + layout->rows * layout->columns * sizeof(double))
    return fail(
        fmt::format("it holds {} numbers where {} x {} are announced", available, layout->rows, layout->columns));
  const auto rows = static_cast<Eigen::Index>(layout->rows);
  const auto columns = static_cast<Eigen::Index>(layout->columns);
  Eigen::MatrixXd result(rows, columns);
  RowMajorMatrix row_major(layout->column_major ? 0 : rows, layout->column_major ? 0 : columns);
  double* const target = layout->column_major ? result.data() : row_major.data();
  if (result.size() > 0)
    std::memcpy(target, bytes.data() + preamble_size + header_size, layout->rows * layout->columns * sizeof(double));
  if (!layout->column_major) result = row_major;
  if (!result.allFinite()) return fail("it holds a number that is not finite");
  return result;
}

std::string npy_preamble(const std::string& type, const std::string& shape) {
  std::string header = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': {}, }}", type, shape);
  // The numbers start at a multiple of 64 bytes; the header ends with a newline.
  const std::size_t padded = (preamble_size + header.size() + 1 + 63) / 64 * 64;
  header.resize(padded - preamble_size - 1, ' ');
  header += '\n';
  std::string bytes = magic;
  bytes += static_cast<char>(header.size() % 256);
  bytes += static_cast<char>(header.size() / 256);
  return bytes + header;
}

Expected<void> write_npy(const std::filesystem::path& file, const Eigen::MatrixXd& matrix) {
  std::string bytes = npy_preamble("<f8", fmt::format("({}, {})", matrix.rows(), matrix.cols()));
  const RowMajorMatrix row_major = matrix;
  bytes.append(reinterpret_cast<const char*>(row_major.data()),
               static_cast<std::size_t>(row_major.size()) * sizeof(double));
  return write_file(file, bytes);
}

Expected<Eigen::MatrixXd> read_npy(const std::filesystem::path& file) {
  const auto bytes = read_file(file);
  if (!bytes) return tl::unexpected(bytes.error());
  auto matrix = parse_npy(*bytes);
  if (!matrix) return fail(fmt::format("{}: {}", file.string(), matrix.error().message));
  return matrix;
}

}  // namespace crumple
