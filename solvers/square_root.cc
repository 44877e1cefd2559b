#include "solvers/square_root.h"

#include <algorithm>

#include "solvers/decompositions.h"
#include "solvers/parallel.h"
#include "solvers/view_partition.h"

namespace crumple {
namespace {

constexpr Eigen::Index kPanelRows =
    64;                                // beside twice the columns: rows that wait to be brought to a triangle together
constexpr std::size_t kMostParts = 8;  // each leaves a triangle, and they cost as much as poses do

// Rows that say something of the common parameters, brought to a triangle whenever there are too many of them.
class Triangle {
 public:
  explicit Triangle(Eigen::Index columns) : rows_(2 * columns + kPanelRows, columns) {}

  void add(const Eigen::MatrixXd& rows) {
    for (Eigen::Index first = 0; first < rows.rows();) {
      if (filled_ == rows_.rows()) compress();
      const Eigen::Index count = std::min(rows_.rows() - filled_, rows.rows() - first);
      rows_.middleRows(filled_, count) = rows.middleRows(first, count);
      filled_ += count;
      first += count;
    }
  }

  const Eigen::MatrixXd& compressed() {
    compress();
    rows_.conservativeResize(filled_, Eigen::NoChange);
    return rows_;
  }

 private:
  void compress() {
    const Eigen::MatrixXd factor = triangular_factor(rows_.topRows(filled_));
    filled_ = factor.rows();
    rows_.topRows(filled_) = factor;
  }

  Eigen::MatrixXd rows_;
  Eigen::Index filled_ = 0;
};

// Rows by the tangents of blocks, side by side, as rows by an eliminated pose (6 columns) and the common parameters.
void append(const Eigen::MatrixXd& by_blocks, const std::vector<BlockId>& blocks, const Parameters& parameters,
            Eigen::MatrixXd& rows) {
  const Eigen::Index first = rows.rows();
  rows.conservativeResize(first + by_blocks.rows(), Eigen::NoChange);
  rows.bottomRows(by_blocks.rows()).setZero();
  for (const Parameters::Span& span : parameters.spans(blocks)) {
    const int column = span.slot ? 0 : 6 + span.common_offset;
    rows.block(first, column, by_blocks.rows(), span.size) = by_blocks.middleCols(span.column, span.size);
  }
}

Eigen::MatrixXd rows_of(const Prior& prior, const CalibrationState& state) {
  const WhitenedPrior whitened = prior.evaluate(state);
  Eigen::MatrixXd rows(whitened.residuals.size(), 0);
  for (const RowMajorMatrix& block : whitened.jacobians) {
    rows.conservativeResize(Eigen::NoChange, rows.cols() + block.cols());
    rows.rightCols(block.cols()) = block;
  }
  return rows;
}

bool concerns(const Prior& prior, const BlockId& block) {
  return std::find(prior.blocks().begin(), prior.blocks().end(), block) != prior.blocks().end();
}

bool concerns_an_eliminated(const Prior& prior, const Parameters& parameters) {
  return parameters.slot(prior.blocks()).has_value();
}

}  // namespace

Eigen::MatrixXd reduced_square_root(const std::vector<std::unique_ptr<View>>& views, const Parameters& parameters,
                                    const NormalEquations::Evaluate& evaluate, const std::vector<Prior>& priors,
                                    const CalibrationState& state, int threads) {
  const Eigen::Index n = parameters.common_size();
  const ViewPartition partitioned =
      partition(views, parameters, std::min(part_count(parameters.common_size()), kMostParts));
  std::vector<Eigen::MatrixXd> parts(partitioned.parts());
  parallel_for(parts.size(), threads, [&](std::size_t part) {
    Triangle triangle(n);
    ViewEvaluation evaluation;
    for (std::size_t i = partitioned.begins[part]; i < partitioned.begins[part + 1];) {
      const auto slot = parameters.slot(views[partitioned.order[i]]->blocks());
      Eigen::MatrixXd rows(0, 6 + n);
      for (; i < partitioned.begins[part + 1]; ++i) {
        const std::size_t v = partitioned.order[i];
        if (parameters.slot(views[v]->blocks()) != slot) break;
        evaluate(v, evaluation);
        append(triangular_factor(evaluation.jacobian) * evaluation.local_from_blocks, views[v]->blocks(), parameters,
               rows);
      }
      if (!slot) {
        triangle.add(rows.rightCols(n));
        continue;
      }
      for (const Prior& prior : priors) {
        if (concerns(prior, parameters.eliminated()[*slot]))
          append(rows_of(prior, state), prior.blocks(), parameters, rows);
      }
      triangle.add(eliminated(rows, 6));
    }
    parts[part] = triangle.compressed();
  });

  Triangle all(n);
  for (const Eigen::MatrixXd& part : parts) all.add(part);
  for (const Prior& prior : priors) {
    if (concerns_an_eliminated(prior, parameters)) continue;
    Eigen::MatrixXd rows(0, 6 + n);
    append(rows_of(prior, state), prior.blocks(), parameters, rows);
    all.add(rows.rightCols(n));
  }
  return all.compressed();
}

}  // namespace crumple
