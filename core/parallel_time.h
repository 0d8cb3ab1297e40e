// How much of a run is parallel.
#pragma once

namespace lamina {

/// Wall seconds of the process so far, on any number of threads, during which a loop of core/parallel.h ran
/// that has more than one chunk; the rest of the wall time is serial.
double parallel_seconds();

}  // namespace lamina
