#pragma once

namespace skerry::measure {

// How much of the machine others have had since this was made: other programs, and what the
// hypervisor kept for itself ("steal"). Figures measured beside others are worth less.
class MachineLoad {
 public:
  MachineLoad();
  double others_share() const;  // of all processors' time, 0 to 1; 0 where /proc/stat is missing

 private:
  double busy_before_ms_, total_before_ms_, own_before_ms_;
};

}  // namespace skerry::measure
