// Memory of the process.
#pragma once

namespace lamina {

/// Gives freed memory back to the system, where the C library can be told to: after a stage that took much,
/// so that the next one does not come on top of it.
void release_freed_memory();

}  // namespace lamina
