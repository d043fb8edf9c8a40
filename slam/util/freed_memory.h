#pragma once

#include <cstdlib>
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace sqslam {

// Makes the C library give large blocks back to the system as soon as they are freed. Otherwise glibc keeps
// all blocks up to the size of the largest one freed so far, and the memory of a long run grows in steps with
// the largest map that it has saved. For the beginning of main().
inline void ReturnFreedMemory() {
#ifdef __GLIBC__
  constexpr int kLarge = 4 << 20;  // above images of a megapixel, which come and go with each frame
  mallopt(M_MMAP_THRESHOLD, kLarge);
  mallopt(M_TRIM_THRESHOLD, 2 * kLarge);
#endif
}

}  // namespace sqslam
