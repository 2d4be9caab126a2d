// What leaves a step: transforms, events, snapshots.
#pragma once

#include <vector>

#include <skerry/events.h>
#include <skerry/jobs/task_graph.h>

namespace skerry::pipeline {

struct WorldData;

// Stage "write_transforms", per island group: poses of body frames for the game.
void write_transforms(WorldData& world, jobs::IndexRange groups, jobs::Task& task);

// Stage "stop_fast", once: fast bodies back to where they first met something, and their transforms.
void stop_fast(WorldData& world, jobs::IndexRange, jobs::Task& task);

// Stage "publish", once: contact events in (pair key) order, the changed list, the snapshot.
void publish(WorldData& world, jobs::IndexRange, jobs::Task& task);

// Moves ContactTable::ended into `events` as "end" events, while the ids are still known.
void collect_end_events(WorldData& world, std::vector<ContactEvent>& events);

}  // namespace skerry::pipeline
