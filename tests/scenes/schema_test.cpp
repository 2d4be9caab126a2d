// data/scene.schema.json and the reader say the same.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "scenes/scene_format.h"
#include "tests/scenes/cases.h"
#include "tests/scenes/json_schema.h"
#include "tests/support/paths.h"

namespace skerry::test {
namespace {

using nlohmann::json;

const json& schema() {
  static const json kSchema =
      json::parse(std::ifstream(source_dir() / "scenes/data/scene.schema.json"));
  return kSchema;
}

const json& definition(std::string_view kind) {
  return kind == "scene" ? schema() : schema().at("$defs").at(std::string(kind));
}

TEST(SceneSchema, objects_have_the_fields_the_reader_knows) {
  for (const scenes::ObjectSpec& spec : scenes::object_specs()) {
    std::set<std::string> known(spec.required.begin(), spec.required.end());
    known.insert(spec.optional.begin(), spec.optional.end());
    std::set<std::string> written;
    for (const auto& [name, rule] : definition(spec.name).at("properties").items()) {
      written.insert(name);
    }
    EXPECT_EQ(written, known) << "fields of " << spec.name;

    std::set<std::string> required;
    if (definition(spec.name).contains("required")) {
      required = definition(spec.name).at("required").get<std::set<std::string>>();
    }
    EXPECT_EQ(required, std::set<std::string>(spec.required.begin(), spec.required.end()))
        << "required fields of " << spec.name;
    EXPECT_EQ(definition(spec.name).at("additionalProperties"), false) << spec.name;
  }
}

TEST(SceneSchema, every_object_of_the_schema_is_one_the_reader_knows) {
  for (const auto& [name, rule] : schema().at("$defs").items()) {
    if (!rule.contains("properties")) continue;
    const auto specs = scenes::object_specs();
    EXPECT_TRUE(std::any_of(specs.begin(), specs.end(), [&known = name](const auto& spec) {
      return spec.name == known;
    })) << name;
  }
}

TEST(SceneSchema, the_full_scene_is_valid_and_uses_every_field) {
  const json full = json::parse(full_scene());
  EXPECT_EQ(schema_violation(schema(), full), "");
  const std::string text = full_scene();
  for (const scenes::ObjectSpec& spec : scenes::object_specs()) {
    for (const auto& fields : {spec.required, spec.optional}) {
      for (const std::string_view field : fields) {
        EXPECT_NE(text.find('"' + std::string(field) + '"'), std::string::npos) << field;
      }
    }
  }
}

TEST(SceneSchema, refuses_what_it_can_tell_and_nothing_else) {
  for (const WrongScene& wrong : wrong_scenes()) {
    const json value = json::parse(wrong.text, nullptr, false);
    if (value.is_discarded()) continue;  // not JSON: no schema is asked
    EXPECT_EQ(schema_violation(schema(), value) != "", wrong.schema_can_tell) << wrong.name;
  }
}

TEST(SceneSchema, shipped_scenes_are_valid) {
  for (const auto& entry : std::filesystem::directory_iterator(source_dir() / "scenes/data")) {
    const std::string name = entry.path().filename().string();
    if (!name.ends_with(".json") || name == "scene.schema.json") continue;
    EXPECT_EQ(schema_violation(schema(), json::parse(std::ifstream(entry.path()))), "") << name;
  }
}

}  // namespace
}  // namespace skerry::test
