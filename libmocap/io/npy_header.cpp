#include "libmocap/io/npy_header.hpp"

#include <charconv>

#include "libmocap/base/checked.hpp"

namespace mocap::io {
namespace {

constexpr std::string_view kMagic("\x93NUMPY", 6);

// The few forms NumPy writes: {'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }
class DictParser {
 public:
  DictParser(std::string_view text, const Where& where) : text_(text), where_(where) {}

  NpyHeader run() {
    expect('{');
    while (!accept('}')) {
      const std::string key = quoted();
      expect(':');
      if (key == "descr") {
        out_.descr = quoted();
        descr_ = true;
      } else if (key == "fortran_order") {
        fortran_ = boolean();
        order_ = true;
      } else if (key == "shape") {
        shape();
        shape_ = true;
      } else {
        fail("key '" + key + "'");
      }
      if (!accept(',')) {
        expect('}');
        break;
      }
    }
    skip();
    if (!text_.empty()) fail("text behind the dict");
    if (!descr_ || !order_ || !shape_) fail("a missing key");
    out_.count = element_count(out_.shape, where_);
    type();
    if (fortran_ && out_.shape.size() > 1)
      refuse(where_, "a Fortran-order array of shape " + shape_text(out_.shape) + ", expected C order",
             "save it with numpy.ascontiguousarray");
    return out_;
  }

 private:
  [[noreturn]] void fail(const std::string& found) const {
    refuse(where_, "a .npy header with " + found + ", expected descr, fortran_order and shape");
  }
  void skip() {
    while (!text_.empty() && (text_.front() == ' ' || text_.front() == '\n')) text_.remove_prefix(1);
  }
  bool accept(char c) {
    skip();
    if (text_.empty() || text_.front() != c) return false;
    text_.remove_prefix(1);
    return true;
  }
  void expect(char c) {
    if (!accept(c))
      fail(text_.empty() ? "a sudden end" : "'" + std::string(text_.substr(0, 12)) + "' where '" + c + "' should be");
  }
  std::string quoted() {
    skip();
    const char quote = text_.empty() ? '\0' : text_.front();
    if (quote == '[') refuse(where_, "a structured array, expected plain numbers or texts");
    if (quote != '\'' && quote != '"') fail("'" + std::string(text_.substr(0, 12)) + "' where a text should be");
    const auto close = text_.find(quote, 1);
    if (close == std::string_view::npos) fail("an open text");
    std::string s(text_.substr(1, close - 1));
    text_.remove_prefix(close + 1);
    return s;
  }
  bool boolean() {
    skip();
    for (const bool value : {false, true}) {
      const std::string_view word = value ? "True" : "False";
      if (!text_.starts_with(word)) continue;
      text_.remove_prefix(word.size());
      return value;
    }
    fail("a fortran_order that is neither True nor False");
  }
  void shape() {
    expect('(');
    while (!accept(')')) {
      skip();
      std::size_t n = 0;
      const auto r = std::from_chars(text_.data(), text_.data() + text_.size(), n);
      if (r.ec != std::errc{}) fail("a dimension that is no whole number of at least 0");
      text_.remove_prefix(static_cast<std::size_t>(r.ptr - text_.data()));
      accept('L');  // written by Python 2
      out_.shape.push_back(n);
      if (out_.shape.size() > 32) fail("more than 32 dimensions");
      if (!accept(',')) {
        expect(')');
        break;
      }
    }
  }
  void type() {
    const std::string& d = out_.descr;
    const auto unsupported = [&](const char* hint = "") {
      refuse(where_, "dtype '" + d.substr(0, 20) + "', expected little-endian f4 f8 i4 i8 u1 u4 u8 b1 S or U", hint);
    };
    if (d.size() < 2) unsupported();
    const char order = d[0], kind = d[1];
    std::size_t n = 0;
    const auto r = std::from_chars(d.data() + 2, d.data() + d.size(), n);
    if (kind == 'O')
      refuse(where_, "an array of pickled Python objects, which is never loaded, expected numbers or texts");
    if (r.ec != std::errc{} || r.ptr != d.data() + d.size()) unsupported();
    if (order == '>' && !(n == 1 || kind == 'S')) unsupported("big-endian; convert with array.astype('<f8')");
    if (order != '<' && order != '|' && order != '=' && order != '>') unsupported();
    out_.item_size = n;
    switch (kind) {
      case 'f':
        out_.type = n == 4 ? NpyType::f4 : NpyType::f8;
        if (n != 4 && n != 8) unsupported();
        break;
      case 'i':
        out_.type = n == 4 ? NpyType::i4 : NpyType::i8;
        if (n != 4 && n != 8) unsupported();
        break;
      case 'u':
        out_.type = n == 1 ? NpyType::u1 : n == 4 ? NpyType::u4 : NpyType::u8;
        if (n != 1 && n != 4 && n != 8) unsupported();
        break;
      case 'b':
        out_.type = NpyType::u1;
        if (n != 1) unsupported();
        break;
      case 'S':
        out_.type = NpyType::bytes;
        break;
      case 'U':
        out_.type = NpyType::unicode;
        out_.item_size = checked_product(n, 4, where_);
        break;
      default:
        unsupported();
    }
    // Short texts take far more room in memory than in the file, and empty ones take none there.
    if ((kind == 'S' || kind == 'U') && out_.count > (1 << 20))
      refuse(where_, std::to_string(out_.count) + " texts, expected at most 2^20");
  }

  std::string_view text_;
  const Where& where_;
  NpyHeader out_;
  bool fortran_ = false, descr_ = false, order_ = false, shape_ = false;
};

std::size_t little_endian(std::string_view bytes) {
  std::size_t v = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) v = v << 8 | static_cast<unsigned char>(bytes[i]);
  return v;
}

std::size_t prefix_size(std::string_view magic) { return magic[6] == 1 ? 10 : 12; }

}  // namespace

std::size_t npy_header_left(std::string_view magic, std::size_t size, const Where& where) {
  if (magic.substr(0, 6) != kMagic) refuse(where, "no .npy signature, expected an array written by NumPy");
  if (magic[6] < 1 || magic[6] > 3 || magic[7] != 0)
    refuse(where, ".npy version " + std::to_string(+static_cast<unsigned char>(magic[6])) + "." +
                      std::to_string(+static_cast<unsigned char>(magic[7])) + ", expected 1.0, 2.0 or 3.0");
  const std::size_t prefix = prefix_size(magic), length = prefix + little_endian(magic.substr(8, prefix - 8));
  if (length > size || length < kNpyMagicSize || length > (1 << 20))
    refuse(where, "a .npy header of " + std::to_string(length) + " bytes in a member of " + std::to_string(size));
  return length - kNpyMagicSize;
}

NpyHeader parse_npy_header(std::string_view header, const Where& where) {
  return DictParser(header.substr(prefix_size(header)), where).run();
}

std::string npy_header(const std::string& descr, const std::vector<std::size_t>& shape) {
  std::string dict = "{'descr': '" + descr + "', 'fortran_order': False, 'shape': " + shape_text(shape) + ", }";
  dict.append(63 - (10 + dict.size()) % 64, ' ');
  dict += '\n';
  std::string out(kMagic);
  out += '\x01';
  out += '\0';
  out += static_cast<char>(dict.size() & 0xff);
  out += static_cast<char>(dict.size() >> 8);
  return out + dict;
}

std::size_t element_count(const std::vector<std::size_t>& shape, const Where& where) {
  std::size_t n = 1;
  for (const std::size_t d : shape) n = checked_product(n, d, where);
  return n;
}

std::string shape_text(const std::vector<std::size_t>& shape) {
  std::string s = "(";
  for (std::size_t i = 0; i < shape.size(); ++i) s += (i ? ", " : "") + std::to_string(shape[i]);
  return s + (shape.size() == 1 ? ",)" : ")");
}

}  // namespace mocap::io
