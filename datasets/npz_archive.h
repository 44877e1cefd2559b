// NumPy's .npz in memory: a ZIP archive, uncompressed, of .npy arrays.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace crumple {

class NpzArchive {
 public:
  // C order; no shape is a scalar. The count of the values has to be the product of the shape.
  void add(const std::string& name, const std::vector<std::size_t>& shape, const std::vector<double>& values);
  void add(const std::string& name, const std::vector<std::size_t>& shape, const std::vector<std::int32_t>& values);
  void add_flag(const std::string& name, bool value);
  void add_text(const std::string& name, const std::string& ascii);

  std::string bytes() const;

 private:
  struct Entry {
    std::string name;
    std::string content;
  };
  void add_array(const std::string& name, const std::string& type, const std::vector<std::size_t>& shape,
                 const std::string& data);

  std::vector<Entry> entries_;
};

// Python's base64.b85encode: five characters for four bytes, none of them a quote or a backslash.
std::string base85(const std::string& bytes);

}  // namespace crumple
