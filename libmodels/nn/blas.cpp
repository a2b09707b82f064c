#include "libmodels/nn/blas.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <malloc.h>
#include <time.h>
#include <torch/torch.h>
#include <torch/version.h>

#include "libmocap/base/error.hpp"
#include "libmodels/nn/packed_matrix.hpp"

namespace mocap::nn {
namespace {

template <class F>
F* find(const char* name) {
  return reinterpret_cast<F*>(dlsym(RTLD_DEFAULT, name));
}

double seconds(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// Processor time of the whole process over that of this thread during a large product: 1 where BLAS is single-threaded.
double threads_used_by_a_product() {
  const torch::NoGradGuard guard;
  const torch::Tensor a = torch::ones({384, 384});
  (void)torch::mm(a, a);
  const double process = seconds(CLOCK_PROCESS_CPUTIME_ID), thread = seconds(CLOCK_THREAD_CPUTIME_ID);
  for (int i = 0; i < 4; ++i) (void)torch::mm(a, a);
  return (seconds(CLOCK_PROCESS_CPUTIME_ID) - process) / (seconds(CLOCK_THREAD_CPUTIME_ID) - thread);
}

[[noreturn]] void refuse_threads(const std::string& found) {
  throw Error(Exit::internal, {}, fmt::format("{}, expected BLAS on one thread per worker", found),
              "set OPENBLAS_NUM_THREADS=1, OMP_NUM_THREADS=1 and MKL_NUM_THREADS=1 before starting");
}

}  // namespace

void initialize_worker_thread() {
  at::set_num_threads(1);
  // Where the BLAS is built on OpenMP its count is per thread too.
  if (auto* set = find<void(int)>("omp_set_num_threads")) set(1);
}

void use_one_blas_thread() {
  initialize_worker_thread();
  if (auto* openblas = find<void(int)>("openblas_set_num_threads"))
    openblas(1);
  else if (auto* mkl = find<void(int)>("MKL_Set_Num_Threads"))
    mkl(1);
  else if (auto* blis = find<void(long)>("bli_thread_set_num_threads"))
    blis(1);
  check_one_blas_thread();
#if defined(__GLIBC__)
  mallopt(M_ARENA_MAX, 1);
  mallopt(M_MMAP_MAX, 0);
  mallopt(M_TRIM_THRESHOLD, 2047 << 20);
#endif
}

void check_one_blas_thread() {
  if (auto* openblas = find<int()>("openblas_get_num_threads")) {
    if (openblas() != 1) refuse_threads(fmt::format("OpenBLAS keeps {} threads", openblas()));
  } else if (auto* mkl = find<int()>("MKL_Get_Max_Threads")) {
    if (mkl() != 1) refuse_threads(fmt::format("MKL keeps {} threads", mkl()));
  } else if (const double used = threads_used_by_a_product(); used > 1.5) {
    refuse_threads(fmt::format("the BLAS runs on {:.1f} threads", used));
  }
  if (at::get_num_threads() != 1) refuse_threads(fmt::format("ATen keeps {} threads", at::get_num_threads()));
}

std::string compute_libraries() {
  std::string blas = "BLAS unknown";
  if (auto* config = find<char*()>("openblas_get_config")) {
    blas = config();
    if (auto* core = find<char*()>("openblas_get_corename"); core && !blas.ends_with(core()))
      blas += fmt::format(" ({})", core());
  } else if (dlsym(RTLD_DEFAULT, "MKL_Set_Num_Threads")) {
    blas = "MKL";
  }
  return fmt::format("LibTorch {}, {}, kernels {}", TORCH_VERSION, blas, isa_name(best_isa()));
}

}  // namespace mocap::nn
