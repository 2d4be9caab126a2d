#include "tests/scenes/json_schema.h"

#include <set>
#include <stdexcept>

namespace skerry::test {
namespace {

using nlohmann::json;

class Checker {
 public:
  explicit Checker(const json& root) : root_(root) {}

  std::string check(const json& schema, const json& value, const std::string& at) const {
    for (const auto& [keyword, rule] : schema.items()) {
      std::string what = apply(keyword, rule, schema, value, at);
      if (!what.empty()) return what;
    }
    return "";
  }

 private:
  static std::string fail_if(bool wrong, const std::string& at, const std::string& what) {
    return wrong ? at + ": " + what : "";
  }

  static bool is_type(const std::string& type, const json& value) {
    if (type == "object") return value.is_object();
    if (type == "array") return value.is_array();
    if (type == "string") return value.is_string();
    if (type == "boolean") return value.is_boolean();
    if (type == "number") return value.is_number();
    if (type == "integer") {
      return value.is_number_integer() ||
             (value.is_number() && value.get<double>() == std::floor(value.get<double>()));
    }
    throw std::runtime_error("unknown type " + type);
  }

  const json& definition(const std::string& ref) const {
    return root_.at(json::json_pointer(ref.substr(1)));
  }

  std::string one_of(const json& choices, const json& value, const std::string& at) const {
    int matches = 0;
    std::string last;
    for (const json& choice : choices) {
      const std::string what = check(choice, value, at);
      if (what.empty()) ++matches;
      if (!what.empty()) last = what;
    }
    if (matches == 1) return "";
    return at + ": " + std::to_string(matches) + " of oneOf match; " + last;
  }

  std::string properties(const json& schema, const json& value, const std::string& at) const {
    static const json kNone = json::object();
    if (!value.is_object()) return "";
    const json& known = schema.contains("properties") ? schema.at("properties") : kNone;
    for (const auto& [name, member] : value.items()) {
      const std::string place = at + '.' + name;
      if (known.contains(name)) {
        const std::string what = check(known.at(name), member, place);
        if (!what.empty()) return what;
      } else if (schema.contains("additionalProperties")) {
        const json& rule = schema.at("additionalProperties");
        if (rule.is_boolean() && !rule.get<bool>()) return place + ": not allowed";
        if (rule.is_object()) {
          const std::string what = check(rule, member, place);
          if (!what.empty()) return what;
        }
      }
    }
    return "";
  }

  std::string apply(const std::string& keyword, const json& rule, const json& schema,
                    const json& value, const std::string& at) const {
    static const std::set<std::string> kSilent = {"$schema", "$defs", "title", "description"};
    if (kSilent.contains(keyword)) return "";
    if (keyword == "$ref") return check(definition(rule), value, at);
    if (keyword == "oneOf") return one_of(rule, value, at);
    if (keyword == "type") return fail_if(!is_type(rule, value), at, "not of type " + rule.dump());
    if (keyword == "const") return fail_if(value != rule, at, "not " + rule.dump());
    if (keyword == "enum") {
      return fail_if(std::find(rule.begin(), rule.end(), value) == rule.end(), at, "not in enum");
    }
    if (keyword == "properties" || keyword == "additionalProperties") {
      return properties(schema, value, at);
    }
    if (keyword == "required") {
      for (const std::string name : rule) {
        if (value.is_object() && !value.contains(name)) return at + ": " + name + " is missing";
      }
      return "";
    }
    if (keyword == "items") {
      for (std::size_t i = 0; value.is_array() && i < value.size(); ++i) {
        const std::string what = check(rule, value[i], at + '[' + std::to_string(i) + ']');
        if (!what.empty()) return what;
      }
      return "";
    }
    if (keyword == "minItems") return fail_if(value.is_array() && value.size() < rule, at, "short");
    if (keyword == "maxItems") return fail_if(value.is_array() && value.size() > rule, at, "long");
    if (keyword == "minLength") {
      return fail_if(value.is_string() && value.get<std::string>().size() < rule, at, "short");
    }
    const bool number = value.is_number();
    if (keyword == "minimum") return fail_if(number && value < rule, at, "too small");
    if (keyword == "maximum") return fail_if(number && value > rule, at, "too large");
    if (keyword == "exclusiveMinimum") return fail_if(number && value <= rule, at, "too small");
    throw std::runtime_error("json_schema.cpp does not know the keyword " + keyword);
  }

  const json& root_;
};

}  // namespace

std::string schema_violation(const nlohmann::json& schema, const nlohmann::json& value) {
  return Checker(schema).check(schema, value, "$");
}

}  // namespace skerry::test
