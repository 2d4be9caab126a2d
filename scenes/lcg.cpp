#include "scenes/lcg.h"

#include "scenes/rigid_maths.h"

namespace skerry::scenes {

Quat Lcg::orientation() {
  const double x = symmetric(1);
  const double y = symmetric(1);
  const double z = symmetric(1);
  const double w = symmetric(1);
  return normalized(x, y, z, w);
}

}  // namespace skerry::scenes
