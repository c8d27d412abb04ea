#include "weldcell/files/document.hpp"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>

namespace weldcell::files {

namespace {

/// Ends the parse where a rule of ours is broken.
struct Refused {
  Fault fault;
};

class TreeBuilder : public YAML::EventHandler {
 public:
  explicit TreeBuilder(std::string name) : name_(std::move(name)) {}

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ > 1) refuse(mark, "a second document begins", "one document a file; remove '---'");
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    refuse_anchor(mark, anchor);
    place(mark, Node::Kind::Null);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    refuse(mark, "aliases (*name) are not read", "write the value out");
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    refuse_anchor(mark, anchor);
    refuse_tag(mark, tag);
    Node* node = place(mark, Node::Kind::Scalar, &value);
    if (node == nullptr) return;
    node->text = value;
    node->quoted = tag == "!";
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open(mark, tag, anchor, Node::Kind::Sequence);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open(mark, tag, anchor, Node::Kind::Map);
  }
  void OnMapEnd() override { close(); }

  Node root;
  Faults duplicates;

 private:
  struct Open {
    std::unique_ptr<Node> node;
    bool key_taken = false;  ///< a map's key stands and waits for its value
  };

  [[noreturn]] void refuse(const YAML::Mark& mark, std::string what, std::string mend) const {
    throw Refused{{name_, mark.line + 1, "", std::move(what), std::move(mend)}};
  }
  void refuse_anchor(const YAML::Mark& mark, YAML::anchor_t anchor) const {
    if (anchor != 0)
      refuse(mark, "anchors (&name) are not read", "write the value out wherever it is needed");
  }
  void refuse_tag(const YAML::Mark& mark, const std::string& tag) const {
    if (!tag.empty() && tag != "?" && tag != "!")
      refuse(mark, "the tag '" + tag + "' is not read", "remove it");
  }

  void open(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, Node::Kind kind) {
    refuse_anchor(mark, anchor);
    refuse_tag(mark, tag);
    if (static_cast<int>(stack_.size()) >= kMaxDepth) {
      refuse(mark, "nested deeper than " + std::to_string(kMaxDepth) + " levels", "flatten it");
    }
    count(mark);
    if (!stack_.empty() && stack_.back().node->kind == Node::Kind::Map && !stack_.back().key_taken) {
      refuse(mark, "a list or mapping stands where a key should", "a key is a plain word");
    }
    auto node = std::make_unique<Node>();
    node->kind = kind;
    node->line = mark.line + 1;
    stack_.push_back({std::move(node), false});
  }

  void close() {
    Node done = std::move(*stack_.back().node);
    stack_.pop_back();
    if (stack_.empty()) {
      root = std::move(done);
    } else {
      stack_.back().node->items.push_back(std::move(done));
      stack_.back().key_taken = false;
    }
  }

  /// Puts a leaf where it belongs; nullptr when it became a key.
  Node* place(const YAML::Mark& mark, Node::Kind kind, const std::string* text = nullptr) {
    count(mark);
    if (stack_.empty()) {
      root.kind = kind;
      root.line = mark.line + 1;
      return &root;
    }
    Open& top = stack_.back();
    if (top.node->kind == Node::Kind::Map && !top.key_taken) {
      if (text == nullptr) refuse(mark, "an empty key", "write the key before the colon");
      take_key(mark, top, *text);
      return nullptr;
    }
    Node leaf;
    leaf.kind = kind;
    leaf.line = mark.line + 1;
    top.node->items.push_back(std::move(leaf));
    top.key_taken = false;
    return &top.node->items.back();
  }

  void take_key(const YAML::Mark& mark, Open& top, const std::string& text) {
    if (top.node->keys.size() >= 1000) refuse(mark, "more than 1000 keys in one mapping", "use a list");
    for (const Node::Key& earlier : top.node->keys) {
      if (earlier.text == text) {
        duplicates.push_back({name_, mark.line + 1, text,
                              "stands twice, first in line " + std::to_string(earlier.line),
                              "remove one of the two"});
        break;
      }
    }
    top.node->keys.push_back({text, mark.line + 1});
    top.key_taken = true;
  }

  void count(const YAML::Mark& mark) {
    if (++nodes_ > kMaxNodes)
      refuse(mark, "more than " + std::to_string(kMaxNodes) + " values", "split the file");
  }

  std::string name_;
  std::vector<Open> stack_;
  std::size_t nodes_ = 0;
  int documents_ = 0;
};

/// yaml-cpp recurses into flow collections before the handler hears of them; a cheap look keeps bombs out.
int deepest_flow(std::string_view text) {
  int depth = 0, deepest = 0;
  for (const char c : text) {
    if (c == '[' || c == '{') deepest = std::max(deepest, ++depth);
    if ((c == ']' || c == '}') && depth > 0) --depth;
    if (c == '\n' && depth > 64) break;
  }
  return deepest;
}

/// The first line whose indent holds a tab, 0 when none does.
int first_tab_line(std::string_view text) {
  for (int line = 1; !text.empty(); ++line) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::size_t word = std::min(text.substr(0, end).find_first_not_of(" \t"), end);
    if (text.substr(0, word).find('\t') != std::string_view::npos) return line;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return 0;
}

}  // namespace

const Node* Node::find(std::string_view key) const {
  for (std::size_t i = 0; i < keys.size() && i < items.size(); ++i) {
    if (keys[i].text == key) return &items[i];
  }
  return nullptr;
}

std::string Node::describe() const {
  switch (kind) {
    case Kind::Null:
      return "nothing";
    case Kind::Sequence:
      return "a list of " + std::to_string(items.size());
    case Kind::Map:
      return "a mapping";
    case Kind::Scalar:
      break;
  }
  const std::string shown = text.size() > 40 ? text.substr(0, 40) + "..." : text;
  return (quoted ? "the quoted text '" : "'") + shown + "'";
}

std::variant<Node, Faults> parse_document(std::string_view text, const std::string& name) {
  if (text.size() > kMaxFileBytes) {
    return Faults{{name, 0, "", "has " + std::to_string(text.size()) + " bytes",
                   "at most " + std::to_string(kMaxFileBytes) + " are read"}};
  }
  const std::size_t nul = text.find('\0');
  if (nul != std::string_view::npos) {
    return Faults{{name, 0, "", "holds a NUL byte at " + std::to_string(nul), "this is no YAML text"}};
  }
  if (deepest_flow(text) > 64) {
    return Faults{{name, 0, "", "brackets nested deeper than 64", "flatten it"}};
  }
  TreeBuilder builder(name);
  try {
    std::istringstream stream{std::string(text)};
    YAML::Parser parser(stream);
    while (parser.HandleNextDocument(builder)) {
    }
  } catch (const Refused& refused) {
    return Faults{refused.fault};
  } catch (const YAML::Exception& error) {
    if (const int line = first_tab_line(text); line > 0 && line <= error.mark.line + 1)
      return Faults{{name, line, "", "is indented with a tab", "indent with blanks: YAML knows no tabs"}};
    return Faults{{name, error.mark.line + 1, "", "is not valid YAML: " + error.msg,
                   "mend this line or the one before it; is the file complete?"}};
  }
  if (builder.root.kind == Node::Kind::Null) {
    return Faults{{name, 0, "", "is empty", "see docs/FORMATS.md for what belongs in it"}};
  }
  if (builder.root.kind != Node::Kind::Map) {
    return Faults{{name, builder.root.line, "", "holds " + builder.root.describe() + " instead of keys",
                   "is the file complete? See docs/FORMATS.md"}};
  }
  if (!builder.duplicates.empty()) return builder.duplicates;
  return std::move(builder.root);
}

std::variant<std::string, Faults> read_text_file(const std::string& path) {
  const auto fault = [&](std::string what, std::string mend) {
    return Faults{{path, 0, "", std::move(what), std::move(mend)}};
  };
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) return fault("no such file", "check the path");
  if (!std::filesystem::is_regular_file(status)) return fault("is not a file", "name a file");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) return fault("cannot be read", "check its permissions");
  std::string text(kMaxFileBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (stream.bad()) return fault("cannot be read to its end", "check the disk");
  if (text.size() > kMaxFileBytes) {
    return fault("is bigger than " + std::to_string(kMaxFileBytes) + " bytes",
                 "no cell, job or workpiece is");
  }
  return text;
}

FileKind file_kind(const Node& document) {
  if (document.find("job") != nullptr) return FileKind::Job;
  if (document.find("cell") != nullptr) return FileKind::Cell;
  if (document.find("scene") != nullptr) return FileKind::Scene;
  if (document.find("arm") != nullptr) return FileKind::Arm;
  // With a word behind it, 'workpiece' is a job's reference and the job's own name was forgotten.
  if (const Node* workpiece = document.find("workpiece"))
    return workpiece->kind == Node::Kind::Scalar ? FileKind::Job : FileKind::Workpiece;
  return FileKind::Unknown;
}

}  // namespace weldcell::files
