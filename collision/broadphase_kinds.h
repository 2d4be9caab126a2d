// The kinds of broadphase, one file each.
#pragma once

#include <memory>

#include "collision/broadphase.h"

namespace skerry::collision {

std::unique_ptr<Broadphase> make_tree_broadphase();
// Boxes sorted along one axis, in classes of size so that one long box does not spoil the sweep.
std::unique_ptr<Broadphase> make_sweep_broadphase();
// fcl::DynamicAABBTreeCollisionManager: oracle and measured row.
std::unique_ptr<Broadphase> make_fcl_broadphase();

}  // namespace skerry::collision
