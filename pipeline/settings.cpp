#include <skerry/settings.h>

namespace skerry {

const char* to_string(ThreadingMode mode) {
  switch (mode) {
    case ThreadingMode::serial:
      return "serial";
    case ThreadingMode::dedicated_thread:
      return "dedicated_thread";
    case ThreadingMode::dedicated_thread_jobs:
      return "dedicated_thread_jobs";
    case ThreadingMode::fork_join:
      return "fork_join";
    case ThreadingMode::job_system:
      return "job_system";
  }
  return "?";
}

const char* to_string(BlockPolicy policy) {
  switch (policy) {
    case BlockPolicy::all:
      return "all";
    case BlockPolicy::all_but_newest:
      return "all_but_newest";
    case BlockPolicy::never:
      return "never";
  }
  return "?";
}

const char* to_string(Integrator integrator) {
  switch (integrator) {
    case Integrator::explicit_euler:
      return "explicit_euler";
    case Integrator::semi_implicit_euler:
      return "semi_implicit_euler";
    case Integrator::velocity_verlet:
      return "velocity_verlet";
    case Integrator::rk4:
      return "rk4";
    case Integrator::exact:
      return "exact";
  }
  return "?";
}

const char* to_string(BroadphaseKind kind) {
  switch (kind) {
    case BroadphaseKind::tree:
      return "tree";
    case BroadphaseKind::sweep_and_prune:
      return "sweep_and_prune";
    case BroadphaseKind::fcl:
      return "fcl";
  }
  return "?";
}

const char* to_string(SolverKind kind) {
  switch (kind) {
    case SolverKind::soft_step_tgs:
      return "soft_step_tgs";
    case SolverKind::pgs:
      return "pgs";
    case SolverKind::penalty:
      return "penalty";
  }
  return "?";
}

const char* to_string(PositionCorrection correction) {
  switch (correction) {
    case PositionCorrection::baumgarte:
      return "baumgarte";
    case PositionCorrection::split_impulse:
      return "split_impulse";
  }
  return "?";
}

}  // namespace skerry
