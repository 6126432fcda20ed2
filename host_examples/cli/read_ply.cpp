// PLY, ASCII and binary of either byte order: element "vertex" with x, y, z and element "face" with a list vertex_indices
// (or vertex_index); every other element and property is passed over.
//
// Our own reader, because the small ones there are trust the file: a wrong count makes them allocate without bound, read past
// a line, or loop for ever. Here nothing is allocated by an announced count, and every value is checked to be there.
#include "judge.hpp"
#include "mesh.hpp"
#include "text_lines.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <utility>

namespace cli {

namespace {

enum class Type { none, i8, u8, i16, u16, i32, u32, f32, f64 };

struct Property {
  std::string name;
  Type type;
  Type count = Type::none;  // of a list's length; none for a plain property
};

struct Element {
  std::string name;
  uint64_t count;
  std::vector<Property> properties;
};

enum class Format { ascii, little_endian, big_endian };

struct Header {
  Format format;
  std::vector<Element> elements;
};

Type type_of(std::string_view word) {
  static constexpr std::pair<std::string_view, Type> kNames[] = {
      {"char", Type::i8},   {"uchar", Type::u8},   {"short", Type::i16},   {"ushort", Type::u16},
      {"int", Type::i32},   {"uint", Type::u32},   {"float", Type::f32},   {"double", Type::f64},
      {"int8", Type::i8},   {"uint8", Type::u8},   {"int16", Type::i16},   {"uint16", Type::u16},
      {"int32", Type::i32}, {"uint32", Type::u32}, {"float32", Type::f32}, {"float64", Type::f64}};
  for (const auto &[name, type] : kNames)
    if (name == word) return type;
  return Type::none;
}

std::size_t size_of(Type type) {
  static constexpr std::size_t kSizes[] = {0, 1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

// ------------------------------------------------------------------------------------------------------------ header

Format read_format(TextLines &lines) {
  const std::string_view kind = lines.word();
  if (lines.word() != "1.0") lines.fail("only PLY version 1.0 is known");
  if (kind == "ascii") return Format::ascii;
  if (kind == "binary_little_endian") return Format::little_endian;
  if (kind == "binary_big_endian") return Format::big_endian;
  lines.fail("the format must be ascii, binary_little_endian or binary_big_endian");
}

Property read_property(TextLines &lines) {
  Property property{};
  std::string_view word = lines.word();
  if (word == "list") {
    property.count = type_of(lines.word());
    if (property.count == Type::none || property.count >= Type::f32)
      lines.fail("a list's length must have a whole-number type");
    word = lines.word();
  }
  property.type = type_of(word);
  if (property.type == Type::none) lines.fail("unknown property type '" + std::string(word) + "'");
  property.name = lines.word();
  return property;
}

Header read_header(TextLines &lines) {
  if (!lines.next_line() || lines.word() != "ply") lines.fail("a PLY file begins with the word ply");
  if (!lines.next_line() || lines.word() != "format") lines.fail("the second line of a PLY file states its format");
  Header header{read_format(lines), {}};
  while (lines.next_line()) {
    const std::string_view word = lines.word();
    if (word == "end_header") return header;
    if (word == "comment" || word == "obj_info") continue;
    if (word == "element") {
      std::string name(lines.word());
      header.elements.push_back({name, lines.index("the number of '" + name + "' elements"), {}});
    } else if (word == "property" && !header.elements.empty()) {
      header.elements.back().properties.push_back(read_property(lines));
    } else {
      lines.fail("unexpected word in a PLY header");
    }
  }
  lines.fail("the file ends inside the header");
}

// -------------------------------------------------------------------------------------------------------------- data

// The values of a file's body, one after the other.
class Body {
public:
  virtual ~Body() = default;
  virtual void begin_row(const std::string &what) = 0;
  virtual void end() {}  // behind binary data some writers leave a line end
  virtual double value(Type type, const std::string &what) = 0;
  virtual void pass_over(Type type, const std::string &what) = 0;  // anything may stand there
  [[noreturn]] virtual void fail(const std::string &what) const = 0;
};

class AsciiBody : public Body {
public:
  explicit AsciiBody(TextLines &lines) : lines_(lines) {}

  void begin_row(const std::string &what) override {
    end_row();
    if (!lines_.next_line()) lines_.fail("the file ends before " + what + "; is it cut off?");
    in_row_ = true;
  }
  void end() override {
    end_row();
    if (lines_.next_line()) lines_.fail("the file goes on after all that its header announces");
  }
  double value(Type type, const std::string &what) override {
    if (type == Type::f32 || type == Type::f64) return lines_.number(what);
    return static_cast<double>(lines_.whole(what));
  }
  void pass_over(Type, const std::string &what) override {
    if (lines_.word().empty()) lines_.fail("the line ends before " + what);
  }
  void fail(const std::string &what) const override { lines_.fail(what); }

private:
  void end_row() const {
    if (in_row_ && lines_.has_word()) lines_.fail("more stands on the line than the header announces");
  }

  TextLines &lines_;
  bool in_row_ = false;
};

template <class T>
double decode(const unsigned char *bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return static_cast<double>(value);
}

bool host_is_big_endian() {
  const uint16_t one = 1;
  unsigned char first;
  std::memcpy(&first, &one, 1);
  return first == 0;
}

class BinaryBody : public Body {
public:
  BinaryBody(const std::string &path, const std::string &contents, std::size_t start, bool big_endian)
      : path_(path), contents_(contents), at_(start), swap_(big_endian != host_is_big_endian()) {}

  void begin_row(const std::string &) override {}

  double value(Type type, const std::string &what) override {
    unsigned char bytes[8];
    const std::size_t size = size_of(type);
    if (contents_.size() - at_ < size) fail("the file ends before " + what + "; is it cut off?");
    std::memcpy(bytes, contents_.data() + at_, size);
    at_ += size;
    if (swap_) std::reverse(bytes, bytes + size);
    return decode(type, bytes);
  }

  void pass_over(Type type, const std::string &what) override { value(type, what); }
  void fail(const std::string &what) const override { throw FileError(path_, 0, what); }

private:
  static double decode(Type type, const unsigned char *bytes) {
    switch (type) {
      case Type::i8:
        return cli::decode<int8_t>(bytes);
      case Type::u8:
        return cli::decode<uint8_t>(bytes);
      case Type::i16:
        return cli::decode<int16_t>(bytes);
      case Type::u16:
        return cli::decode<uint16_t>(bytes);
      case Type::i32:
        return cli::decode<int32_t>(bytes);
      case Type::u32:
        return cli::decode<uint32_t>(bytes);
      case Type::f32:
        return cli::decode<float>(bytes);
      default:
        return cli::decode<double>(bytes);
    }
  }

  const std::string &path_, &contents_;
  std::size_t at_;
  bool swap_;
};

std::string nth(const std::string &name, uint64_t i) { return name + " " + std::to_string(i); }

// Lengths and indices alike; at most 32 bits, so a double holds them exactly.
uint32_t read_whole(Body &body, Type type, const std::string &what) {
  const double value = body.value(type, what);
  if (!(value >= 0 && value <= UINT32_MAX) || value != std::floor(value))
    body.fail(what + " must be a whole number, 0 or more; found " + format("%.9g", value));
  return static_cast<uint32_t>(value);
}

std::vector<uint32_t> read_list(Body &body, const Property &property, const std::string &owner) {
  const uint32_t count = read_whole(body, property.count, "the length of " + property.name + " of " + owner);
  std::vector<uint32_t> values;
  for (uint32_t k = 0; k < count; ++k)  // a wild count ends where the data end
    values.push_back(read_whole(body, property.type, nth(property.name, k) + " of " + owner));
  return values;
}

void skip(Body &body, const Property &property, const std::string &owner) {
  uint32_t count = 1;
  if (property.count != Type::none)
    count = read_whole(body, property.count, "the length of " + property.name + " of " + owner);
  for (uint32_t k = 0; k < count; ++k) body.pass_over(property.type, property.name + " of " + owner);
}

bool is_coordinate(const Property &property) {
  return property.count == Type::none && property.name.size() == 1 && property.name[0] >= 'x' &&
         property.name[0] <= 'z';
}

bool is_corner_list(const Property &property) {
  return property.count != Type::none && (property.name == "vertex_indices" || property.name == "vertex_index");
}

void read_vertex(Body &body, const Element &element, const std::string &owner, Mesh &mesh) {
  std::array<double, 3> x{};
  for (const Property &property : element.properties) {
    if (!is_coordinate(property)) {
      skip(body, property, owner);
      continue;
    }
    const double value = body.value(property.type, property.name + " of " + owner);
    if (!std::isfinite(value)) body.fail(property.name + " of " + owner + " is not finite");
    x[static_cast<std::size_t>(property.name[0] - 'x')] = value;
  }
  mesh.add_vertex(x);
}

void read_face(Body &body, const Element &element, const std::string &owner, Mesh &mesh) {
  for (const Property &property : element.properties) {
    if (!is_corner_list(property)) {
      skip(body, property, owner);
      continue;
    }
    const std::vector<uint32_t> corners = read_list(body, property, owner);
    if (corners.size() < 3)
      body.fail(owner + " has " + std::to_string(corners.size()) + " corners; at least three are needed");
    mesh.add_polygon(corners);
  }
}

void read_element(Body &body, const Element &element, Mesh &mesh) {
  for (uint64_t i = 0; i < element.count; ++i) {
    const std::string owner = nth(element.name, i);
    body.begin_row(owner + " of " + std::to_string(element.count));
    if (element.name == "vertex")
      read_vertex(body, element, owner, mesh);
    else if (element.name == "face")
      read_face(body, element, owner, mesh);
    else
      for (const Property &property : element.properties) skip(body, property, owner);
  }
}

template <class Predicate>
std::size_t count_properties(const Header &header, const char *element, Predicate predicate) {
  std::size_t count = 0;
  for (const Element &e : header.elements)
    if (e.name == element)
      count += static_cast<std::size_t>(std::count_if(e.properties.begin(), e.properties.end(), predicate));
  return count;
}

void check_header(const std::string &path, const Header &header) {
  for (const Element &e : header.elements)  // such an element takes no bytes, so that its count could not run dry
    if (e.properties.empty()) throw FileError(path, 0, "element '" + e.name + "' has no properties");
  if (count_properties(header, "vertex", is_coordinate) != 3)
    throw FileError(path, 0, "needs an element 'vertex' with the properties x, y and z, once each");
  if (count_properties(header, "face", is_corner_list) != 1)
    throw FileError(path, 0,
                    "needs an element 'face' with one list property vertex_indices; a point cloud is no shell");
}

void check_corners(const std::string &path, const Mesh &mesh) {
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k)
    if (mesh.triangles[k] >= mesh.n_vertices())
      throw FileError(path, 0,
                      "a face names vertex " + std::to_string(mesh.triangles[k]) + ", but there are only " +
                          std::to_string(mesh.n_vertices()) + " (numbered from 0)");
}

}  // namespace

Mesh read_ply(const std::string &path, const std::string &contents) {
  TextLines lines(path, contents);
  const Header header = read_header(lines);
  check_header(path, header);

  std::unique_ptr<Body> body;
  if (header.format == Format::ascii)
    body = std::make_unique<AsciiBody>(lines);
  else
    body = std::make_unique<BinaryBody>(path, contents, lines.position(), header.format == Format::big_endian);

  Mesh mesh;
  for (const Element &element : header.elements) read_element(*body, element, mesh);
  body->end();
  check_corners(path, mesh);
  mesh.cut_polygons();
  return mesh;
}

}  // namespace cli
