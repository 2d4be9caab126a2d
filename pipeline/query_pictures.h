// Pictures of the world for queries, made when somebody asks.
//
//   State      a QueryState beside the world: the bodies that moved are copied into it at the end of
//              each step, those that were edited at the beginning of the next step or of the next
//              query. Nothing is copied until the first query.
//   Pictures   a query brings a picture (QueryScene) up to the state's last stamp and shares it. A
//              picture that nobody holds any more is brought up to date again; while one is held,
//              the next query takes another. So one or two exist, and a world at rest is copied once.
//   Threads    note() and the step's calls from whoever edits or steps the world; newest() and
//              Runner from any thread, beside all of them but note().
#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <vector>

#include "collision/query_scene.h"

namespace skerry::pipeline {

struct WorldData;

class QueryPictures {
 public:
  // A body was added, removed or given other shapes; or only moved by hand.
  enum class Edit : std::uint8_t { shapes, pose };
  void note(core::BodyIndex body, Edit edit);

  // Around a step. Until begin_step() returns, a query sees the state before the step; from
  // publish() on, which is part of the step, the state after it.
  void begin_step(const WorldData& world);
  void publish(const WorldData& world);
  void end_step(bool completed);

  // From now on steps hand over what they moved. Not during a step.
  void want() { wanted_.store(true, std::memory_order_relaxed); }

  // Throws UsageError if asked during a step and never before.
  std::shared_ptr<const collision::QueryScene> newest(const WorldData& world);

  // While one lives that got it, the world's executor is free for a batch of queries.
  class Turn {
   public:
    explicit Turn(QueryPictures& pictures);
    ~Turn();
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    bool got_it() const { return got_it_; }

   private:
    QueryPictures& pictures_;
    bool got_it_ = false;
  };

 private:
  // Pictures nobody holds. Shared, for a reader may outlive the world.
  struct Pool {
    std::mutex mutex;
    std::vector<std::unique_ptr<collision::QueryScene>> scenes;  // guarded
    std::unique_ptr<collision::QueryScene> take();
    void give(std::unique_ptr<collision::QueryScene> scene);
  };
  struct Edited {
    core::BodyIndex body;
    Edit edit;
  };

  void take_over_edits(const WorldData& world);
  void take_over(const WorldData& world, core::BodyIndex body, Edit edit);

  std::atomic<bool> wanted_ = false;
  std::atomic<bool> edited_any_ = true;  // edits_ or all_ have something
  std::vector<Edited> edits_;            // written by whoever edits; taken over under state_mutex_

  mutable std::mutex state_mutex_;
  std::condition_variable executor_free_;
  collision::QueryState state_;  // guarded by state_mutex_, as the next four
  bool all_ = true;              // everything is to be taken over
  bool in_step_ = false;
  bool step_waits_ = false;  // for a batch to end
  bool batch_runs_ = false;
  std::atomic<std::uint64_t> stamp_ = 0;  // state_.stamp, to be read without the mutex

  std::mutex view_mutex_;                                 // before state_mutex_
  std::shared_ptr<const collision::QueryScene> current_;  // guarded by view_mutex_
  std::shared_ptr<Pool> pool_ = std::make_shared<Pool>();
};

}  // namespace skerry::pipeline
