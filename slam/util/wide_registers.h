#pragma once

// SQSLAM_WIDE_REGISTERS before a function of plain loops: it is compiled once more for processors with AVX2,
// which take it where they have that. Both do the same arithmetic (AVX2 alone fuses no multiplications with
// additions): what comes out is the same to the last bit. Sanitizers cannot follow functions that are chosen
// at load time.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define SQSLAM_WIDE_REGISTERS __attribute__((target_clones("default", "avx2")))
#else
#define SQSLAM_WIDE_REGISTERS
#endif
