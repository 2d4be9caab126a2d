// Everything an embedder needs.
#pragma once

#include <skerry/jobs.h>
#include <skerry/world.h>
