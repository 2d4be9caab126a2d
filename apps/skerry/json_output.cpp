#include "apps/skerry/json_output.h"

#include "apps/measure/machine.h"
#include "apps/measure/process_meter.h"
#include "apps/measure/statistics.h"

namespace skerry::app {
namespace {

Json stages_json(const std::vector<measure::StageMean>& stages) {
  Json json = Json::object();
  for (const measure::StageMean& stage : stages) json[stage.name] = stage.wall_ms;
  return json;
}

Json law_json(const ContactLaw& law) {
  return {{"manifolds", law.manifolds},
          {"impulse_mean", law.impulse_mean},
          {"pull_max", law.pull_max},
          {"cone", {{"mean", law.cone_mean}, {"max", law.cone_max}}},
          {"normal", {{"mean", law.normal_mean}, {"max", law.normal_max}}},
          {"friction", {{"mean", law.friction_mean}, {"max", law.friction_max}}}};
}

Json contacts_json(const ContactMeasures& contacts) {
  return {{"energy_lost_j", contacts.energy_lost},
          {"impulse_from_ground", contacts.impulse_from_ground},
          {"normal_impulse", contacts.normal_impulse},
          {"law", law_json(contacts.law)}};
}

Json measured_json(const measure::RunMeasures& run) {
  return {{"penetration_mm",
           {{"mean", 1e3 * run.penetration_mean}, {"max", 1e3 * run.penetration_max}}},
          {"energy_first_j", run.energy_first},
          {"energy_last_j", run.energy_last},
          {"energy_lost_j", run.energy_lost},
          {"law", law_json(run.law)}};
}

Json run_json(const RunIdentity& identity, const measure::RunResult& result) {
  const auto steps = result.step_ms.size();
  const double per_step = 1 / static_cast<double>(std::max<std::size_t>(1, steps));
  const Measures& measures = result.measures;
  Json hashes = Json::array();
  for (const auto& [step, hash] : result.hashes) {
    hashes.push_back({{"step", step}, {"hash", report::hash_text(hash)}});
  }
  return {{"scene", identity.scene},
          {"mode", to_string(identity.mode)},
          {"workers", identity.workers},
          {"steps", steps},
          {"warmup", identity.warmup},
          {"dt", identity.dt},
          {"solver", to_string(identity.solver)},
          {"substeps", identity.substeps},
          {"sleep", identity.sleep},
          {"seed", identity.seed},
          {"bodies", result.bodies},
          {"awake_bodies", result.last.awake_bodies},
          {"shapes", result.last.shapes},
          {"joints", result.last.joints},
          {"pairs", result.last.pairs},
          {"contacts", result.last.contacts},
          {"islands", result.last.islands},
          {"largest_island", result.last.largest_island},
          {"fallback_pairs", result.last.fallback_pairs},
          {"step_ms", report::to_json(measure::summarize(result.step_ms))},
          {"stages_ms", stages_json(result.stages)},
          {"cpu_ms_per_step", result.cpu_ms * per_step},
          {"peak_rss_mb", measure::peak_rss_mb()},
          {"allocations_per_step", static_cast<double>(result.allocations) * per_step},
          {"state_hash", report::hash_text(result.state_hash)},
          {"hashes", std::move(hashes)},
          {"penetration_mm",
           {{"mean", 1e3 * measures.penetration_mean}, {"max", 1e3 * measures.penetration_max}}},
          {"kinetic_energy_j", measures.kinetic_energy},
          {"potential_energy_j", measures.potential_energy},
          {"momentum", measures.momentum},
          {"angular_momentum", measures.angular_momentum},
          {"warnings", result.warnings},
          {"interrupted", result.interrupted},
          {"machine", report::to_json(measure::this_machine())}};
}

}  // namespace

Json to_json(const RunIdentity& identity, const measure::RunResult& result) {
  Json json = run_json(identity, result);
  if (result.measured.steps > 0) {
    json["contact_measures"] = contacts_json(result.measures.contacts);
    json["measured"] = measured_json(result.measured);
  }
  return json;
}

}  // namespace skerry::app
