// Rows of the comparison, as JSON and as a table.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/peers/race.h"

namespace skerry::peers {

// One object per lane. `ratio_to_bullet` is null without Bullet among the lanes.
nlohmann::json rows_of(const PeerScene& scene, const std::vector<Lane>& lanes,
                       const RaceOptions& options);

// How the program was built and run, and on what.
nlohmann::json about(const std::vector<Contestant>& contestants, const RaceOptions& options);

std::string table_header();
std::string table_line(const nlohmann::json& row);

}  // namespace skerry::peers
