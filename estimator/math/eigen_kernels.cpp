#define SHAKER_EIGEN_KERNELS template
#include "estimator/math/eigen_kernels.hpp"
