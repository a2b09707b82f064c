// One thread per worker for BLAS and ATen, whichever BLAS is installed.
//
// LibTorch's default set-up on Debian runs two thread pools on top of each other (OpenMP in ATen, pthreads in OpenBLAS)
// and is 3 to 11 times slower than one thread; at::set_num_threads(1) alone does not reach OpenBLAS. Parallelism comes
// from shards of the batch instead (nn/sharded.hpp), so every BLAS call must stay on its caller's thread.
#pragma once
#include <string>

namespace mocap::nn {

// Sets BLAS (OpenBLAS, MKL or BLIS, found among the loaded libraries) and ATen to one thread and checks that it holds:
// call once, first thing in main, before other threads exist. Also keeps freed tensor memory in the process, since
// returning it costs a page fault per 4 KB of every training step.
// Error(internal), with a hint, where BLAS still uses more than one thread.
void use_one_blas_thread();

// The check alone: Error(internal) unless BLAS and ATen use one thread in this process and thread.
void check_one_blas_thread();

// The part of it that is per thread: every worker thread calls this before its first tensor operation.
void initialize_worker_thread();

// For --version and the log: "LibTorch 1.13.0, OpenBLAS 0.3.21 ... Haswell, kernels avx512".
std::string compute_libraries();

}  // namespace mocap::nn
