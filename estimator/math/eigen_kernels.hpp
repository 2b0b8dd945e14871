// Eigen's kernels for dense matrices of doubles, compiled once in eigen_kernels.cpp: products,
// triangular solves, decompositions. Eigen marks them as not to be inlined, so that a program
// is as fast as with a copy in each file. Part of the precompiled header; no file includes it.
#pragma once

#include <Eigen/Dense>

#ifndef SHAKER_EIGEN_KERNELS
#define SHAKER_EIGEN_KERNELS extern template
#endif

namespace Eigen {
namespace internal {

using ShakerColumns = const_blas_data_mapper<double, Index, ColMajor>;
using ShakerRows = const_blas_data_mapper<double, Index, RowMajor>;
using ShakerResult = blas_data_mapper<double, Index, ColMajor, 0, 1>;
using ShakerBlocks = gebp_traits<double, double>;

SHAKER_EIGEN_KERNELS struct gebp_kernel<double, double, Index, ShakerResult, ShakerBlocks::mr,
                                        ShakerBlocks::nr, false, false>;
SHAKER_EIGEN_KERNELS struct gemm_pack_lhs<double, Index, ShakerColumns, ShakerBlocks::mr,
                                          ShakerBlocks::LhsProgress,
                                          ShakerBlocks::LhsPacket4Packing, ColMajor>;
SHAKER_EIGEN_KERNELS struct gemm_pack_lhs<double, Index, ShakerRows, ShakerBlocks::mr,
                                          ShakerBlocks::LhsProgress,
                                          ShakerBlocks::LhsPacket4Packing, RowMajor>;
SHAKER_EIGEN_KERNELS struct gemm_pack_rhs<double, Index, ShakerColumns, ShakerBlocks::nr, ColMajor>;
SHAKER_EIGEN_KERNELS struct gemm_pack_rhs<double, Index, ShakerRows, ShakerBlocks::nr, RowMajor>;
SHAKER_EIGEN_KERNELS struct general_matrix_vector_product<Index, double, ShakerColumns, ColMajor,
                                                          false, double, ShakerRows, false>;
SHAKER_EIGEN_KERNELS struct general_matrix_vector_product<Index, double, ShakerRows, RowMajor,
                                                          false, double, ShakerColumns, false>;
SHAKER_EIGEN_KERNELS struct general_matrix_vector_product<Index, double, ShakerColumns, ColMajor,
                                                          false, double, ShakerColumns, false>;
SHAKER_EIGEN_KERNELS struct general_matrix_vector_product<Index, double, ShakerRows, RowMajor,
                                                          false, double, ShakerRows, false>;

}  // namespace internal

SHAKER_EIGEN_KERNELS class LLT<MatrixXd>;
SHAKER_EIGEN_KERNELS class LDLT<MatrixXd>;
SHAKER_EIGEN_KERNELS class PartialPivLU<MatrixXd>;
SHAKER_EIGEN_KERNELS class HouseholderQR<MatrixXd>;
SHAKER_EIGEN_KERNELS class ColPivHouseholderQR<MatrixXd>;

}  // namespace Eigen
