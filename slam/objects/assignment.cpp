#include "slam/objects/assignment.h"

#include <limits>

namespace sqslam {
namespace {

// Adds a row to the matching along the shortest augmenting path. Indices are 1-based; column 0 is a dummy.
void AddRow(const Eigen::MatrixXd& cost, int row, std::vector<double>& u, std::vector<double>& v,
            std::vector<int>& row_of_column) {
  const int columns = static_cast<int>(cost.cols());
  std::vector<double> slack(columns + 1, std::numeric_limits<double>::infinity());
  std::vector<int> previous(columns + 1, 0);
  std::vector<bool> used(columns + 1, false);
  int column = 0;
  row_of_column[0] = row;
  do {
    used[column] = true;
    const int i = row_of_column[column];
    double delta = std::numeric_limits<double>::infinity();
    int next = 0;
    for (int j = 1; j <= columns; ++j) {
      if (used[j]) {
        continue;
      }
      const double reduced = cost(i - 1, j - 1) - u[i] - v[j];
      if (reduced < slack[j]) {
        slack[j] = reduced;
        previous[j] = column;
      }
      if (slack[j] < delta) {
        delta = slack[j];
        next = j;
      }
    }
    for (int j = 0; j <= columns; ++j) {
      if (used[j]) {
        u[row_of_column[j]] += delta;
        v[j] -= delta;
      } else {
        slack[j] -= delta;
      }
    }
    column = next;
  } while (row_of_column[column] != 0);
  for (; column != 0; column = previous[column]) {
    row_of_column[column] = row_of_column[previous[column]];
  }
}

}  // namespace

std::vector<int> AssignOptimally(const Eigen::MatrixXd& gain) {
  const int rows = static_cast<int>(gain.rows());
  const int real_columns = static_cast<int>(gain.cols());
  // One dummy column per row at no cost: "not assigned".
  Eigen::MatrixXd cost = Eigen::MatrixXd::Zero(rows, real_columns + rows);
  cost.leftCols(real_columns) = -gain.cwiseMax(0.0);
  std::vector<double> u(rows + 1, 0.0);
  std::vector<double> v(cost.cols() + 1, 0.0);
  std::vector<int> row_of_column(cost.cols() + 1, 0);
  for (int row = 1; row <= rows; ++row) {
    AddRow(cost, row, u, v, row_of_column);
  }
  std::vector<int> result(rows, -1);
  for (int j = 1; j <= real_columns; ++j) {
    const int row = row_of_column[j] - 1;
    if (row >= 0 && gain(row, j - 1) > 0.0) {
      result[row] = j - 1;
    }
  }
  return result;
}

}  // namespace sqslam
