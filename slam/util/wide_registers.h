#pragma once

// SQSLAM_WIDE_REGISTERS before a function of plain loops compiles it a second time for processors with AVX2,
// chosen at load time. Both versions are bit-identical: AVX2 alone does not fuse multiplications with
// additions. SQSLAM_WIDE_INTEGERS, for functions without floating point, has a third version for AVX-512,
// which counts bits in wide registers. Sanitizers cannot follow functions that are chosen at load time.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define SQSLAM_WIDE_REGISTERS __attribute__((target_clones("default", "avx2")))
#define SQSLAM_WIDE_INTEGERS __attribute__((target_clones("default", "avx2", "arch=icelake-server")))
#else
#define SQSLAM_WIDE_REGISTERS
#define SQSLAM_WIDE_INTEGERS
#endif
