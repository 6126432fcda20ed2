// A table of a scene file, read key by key with the place of every mistake.
#pragma once

#include "closest.hpp"
#include "scene.hpp"
#include "text_lines.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "toml.hpp"

namespace cli {

// One table of the file. A key that nobody asks for is an error: it is a misspelling more often than not.
class Section {
public:
  Section(const std::string &path, std::string name, const toml::table &table)
      : path_(path), name_(std::move(name)), table_(table) {}

  [[noreturn]] void fail(const toml::node &at, const std::string &what) const {
    throw FileError(path_, at.source().begin.line, (name_.empty() ? "" : "[" + name_ + "] ") + what);
  }
  [[noreturn]] void fail(const std::string &what) const { fail(table_, what); }
  // File, line and name, for what is found wrong when the mesh is known.
  std::string place() const { return path_ + ":" + std::to_string(table_.source().begin.line) + ": [" + name_ + "]"; }
  const toml::node &table() const { return table_; }

  const toml::node *find(const char *key) {
    known_.insert(key);
    return table_.get(key);
  }

  template <class T>
  std::optional<T> get(const char *key, const char *kind) {
    const toml::node *node = find(key);
    if (!node) return std::nullopt;
    const std::optional<T> value = node->value<T>();
    if (!value) fail(*node, std::string(key) + " must be " + kind);
    return value;
  }

  std::optional<double> number(const char *key) {
    const std::optional<double> value = get<double>(key, "a number");
    if (value && !std::isfinite(*value)) fail(*table_.get(key), std::string(key) + " must be finite");
    return value;
  }
  std::optional<bool> flag(const char *key) { return get<bool>(key, "true or false"); }
  std::optional<std::string> text(const char *key) { return get<std::string>(key, "a text in quotes"); }
  std::optional<uint32_t> count(const char *key) { return get<uint32_t>(key, "a whole number from 0 to 4294967295"); }

  double positive(const char *key, double fallback) {
    const double value = number(key).value_or(fallback);
    if (!(value > 0)) fail(*table_.get(key), std::string(key) + " must be greater than 0");
    return value;
  }

  double not_negative(const char *key, double fallback) {
    const double value = number(key).value_or(fallback);
    if (value < 0) fail(*table_.get(key), std::string(key) + " must not be negative");
    return value;
  }

  // The path of a file that is named relative to the scene.
  std::optional<std::string> file(const char *key) {
    const std::optional<std::string> name = text(key);
    if (!name) return std::nullopt;
    return (std::filesystem::path(path_).parent_path() / *name).lexically_normal().string();
  }

  std::vector<double> numbers(const char *key, std::size_t size) {
    const toml::node *node = find(key);
    const toml::array *array = node ? node->as_array() : nullptr;
    std::vector<double> values;
    for (std::size_t i = 0; array && i < array->size(); ++i)
      if (const std::optional<double> value = (*array)[i].value<double>(); value && std::isfinite(*value))
        values.push_back(*value);
    if (node && (!array || values.size() != array->size() || values.size() != size))
      fail(*node, std::string(key) + " must be a list of " + std::to_string(size) + " numbers");
    return values;  // empty where the key is missing
  }

  // As many numbers as there are; empty where the key is missing.
  std::vector<double> list(const char *key) {
    const toml::node *node = find(key);
    const toml::array *array = node ? node->as_array() : nullptr;
    if (node && (!array || array->empty())) fail(*node, std::string(key) + " must be a list of numbers");
    return numbers(key, array ? array->size() : 0);
  }

  std::array<double, 3> vector(const char *key, const std::array<double, 3> &fallback = {}) {
    const std::vector<double> v = numbers(key, 3);
    return v.empty() ? fallback : std::array<double, 3>{v[0], v[1], v[2]};
  }

  std::optional<Range> range(const char *key) {
    const std::vector<double> v = numbers(key, 2);
    if (v.empty()) return std::nullopt;
    if (v[0] > v[1]) fail(*table_.get(key), std::string(key) + " must be [low, high]");
    return Range{v[0], v[1]};
  }

  // One of the words; the first is the default.
  std::string choice(const char *key, const std::vector<std::string> &words) {
    const std::string word = text(key).value_or(words[0]);
    std::string list;
    for (const std::string &w : words) {
      if (w == word) return word;
      list += (list.empty() ? "" : ", ") + w;
    }
    fail(*table_.get(key), std::string(key) + " is '" + word + "'; it must be one of " + list + did_you_mean(word, words));
  }

  std::optional<Section> section(const char *key) {
    const toml::node *node = find(key);
    if (!node) return std::nullopt;
    if (!node->as_table()) fail(*node, std::string(key) + " must be a table");
    return Section(path_, name_.empty() ? key : name_ + "." + key, *node->as_table());
  }

  std::vector<Section> sections(const char *key) {
    std::vector<Section> all;
    const toml::node *node = find(key);
    const toml::array *array = node ? node->as_array() : nullptr;
    for (std::size_t i = 0; array && i < array->size(); ++i)
      if (const toml::table *table = (*array)[i].as_table())
        all.emplace_back(path_, name_.empty() ? key : name_ + "." + key, *table);
    if (node && (!array || all.size() != array->size()))
      fail(*node, std::string(key) + " must be written as [[" + key + "]]");
    return all;
  }

  void reject_unknown_keys() const {
    for (const auto &[key, value] : table_)
      if (const std::string word(key.str()); !known_.count(word))
        fail(value, "unknown key '" + word + "'" + did_you_mean(word, {known_.begin(), known_.end()}));
  }

private:
  const std::string &path_;
  std::string name_;
  const toml::table &table_;
  std::set<std::string> known_;
};

}  // namespace cli
