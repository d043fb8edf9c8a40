#include "slam/objects/assignment.h"

#include <algorithm>
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

// Runs the Hungarian method on the whole matrix.
std::vector<int> AssignDensely(const Eigen::MatrixXd& gain) {
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

// A connected component of the bipartite graph of positive gains.
struct Block {
  std::vector<int> rows;
  std::vector<int> columns;
};

// Adjacency lists of the positive gains.
struct Ties {
  std::vector<std::vector<int>> of_row;
  std::vector<std::vector<int>> of_column;

  explicit Ties(const Eigen::MatrixXd& gain) : of_row(gain.rows()), of_column(gain.cols()) {
    for (int j = 0; j < gain.cols(); ++j) {
      for (int i = 0; i < gain.rows(); ++i) {
        if (gain(i, j) > 0.0) {
          of_row[i].push_back(j);
          of_column[j].push_back(i);
        }
      }
    }
  }
};

// Returns the block of `row` and marks its rows and columns as seen.
Block BlockOf(const Ties& ties, int row, std::vector<bool>& row_seen, std::vector<bool>& column_seen) {
  Block block{{row}, {}};
  row_seen[row] = true;
  for (std::size_t r = 0; r < block.rows.size(); ++r) {
    for (const int j : ties.of_row[block.rows[r]]) {
      if (column_seen[j]) {
        continue;
      }
      column_seen[j] = true;
      block.columns.push_back(j);
      for (const int i : ties.of_column[j]) {
        if (!row_seen[i]) {
          row_seen[i] = true;
          block.rows.push_back(i);
        }
      }
    }
  }
  return block;
}

}  // namespace

std::vector<int> AssignOptimally(const Eigen::MatrixXd& gain) {
  const Ties ties(gain);
  std::vector<int> result(gain.rows(), -1);
  std::vector<bool> row_seen(gain.rows(), false);
  std::vector<bool> column_seen(gain.cols(), false);
  for (int row = 0; row < gain.rows(); ++row) {
    if (row_seen[row]) {
      continue;
    }
    // Boxes only compete with their neighbours: solving block by block takes a fraction of the cubic time.
    Block block = BlockOf(ties, row, row_seen, column_seen);
    std::ranges::sort(block.rows);
    std::ranges::sort(block.columns);
    const std::vector<int> assigned = AssignDensely(gain(block.rows, block.columns));
    for (std::size_t i = 0; i < assigned.size(); ++i) {
      result[block.rows[i]] = assigned[i] >= 0 ? block.columns[assigned[i]] : -1;
    }
  }
  return result;
}

}  // namespace sqslam
