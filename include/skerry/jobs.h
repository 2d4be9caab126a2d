// The whole of skerry::jobs: a task graph, executors and parallel_for, usable without the engine.
#pragma once

#include <skerry/jobs/executor.h>
#include <skerry/jobs/parallel_for.h>
#include <skerry/jobs/task_graph.h>
#include <skerry/jobs/task_pool.h>
