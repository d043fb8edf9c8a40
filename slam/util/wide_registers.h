#pragma once

// SQSLAM_WIDE_REGISTERS before a function of plain loops compiles it a second time for processors with AVX2,
// chosen at load time. Both versions are bit-identical: AVX2 alone does not fuse multiplications with
// additions. Sanitizers cannot follow functions that are chosen at load time.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define SQSLAM_WIDE_REGISTERS __attribute__((target_clones("default", "avx2")))
#else
#define SQSLAM_WIDE_REGISTERS
#endif
