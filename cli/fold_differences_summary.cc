#include "cli/fold_differences_summary.h"

#include <fmt/format.h>

namespace crumple {

nlohmann::json fold_differences_summary(const FoldDifferences& differences) {
  nlohmann::json summary{{"folds", nlohmann::json::array()},
                         {"quantities", nlohmann::json::array()},
                         {"not_compared", differences.not_compared}};
  for (const Fold& fold : differences.folds) {
    nlohmann::json entry{{"left_out", fold.left_out}, {"compared", fold.not_done.empty()}};
    if (!fold.not_done.empty()) entry["reason"] = fold.not_done;
    summary["folds"].push_back(std::move(entry));
  }
  for (const FoldedQuantity& quantity : differences.quantities) {
    summary["quantities"].push_back({{"name", quantity.name},
                                     {"rms_" + quantity.unit, quantity.rms},
                                     {"expected_rms_" + quantity.unit, quantity.expected_rms},
                                     {"ratio", quantity.ratio},
                                     {"probability", quantity.probability},
                                     {"clearest_fold", quantity.clearest},
                                     {"clearest_ratio", quantity.clearest_ratio}});
  }
  return summary;
}

std::string fold_differences_text(const FoldDifferences& differences) {
  std::string text = fmt::format("{:<30} {:>10} {:>10}    {:>6} {:>8}\n",
                                 fmt::format("without each of {} folds", differences.folds.size()), "change",
                                 "expected", "ratio", "p");
  for (const FoldedQuantity& quantity : differences.quantities) {
    text += fmt::format("  {:<28} {:>10.4f} {:>10.4f} {} {:>6.2f} {:>8.2g}\n", quantity.name, quantity.rms,
                        quantity.expected_rms, quantity.unit, quantity.ratio, quantity.probability);
  }
  for (const std::string& sentence : sentences_of(differences)) text += sentence + "\n";
  return text;
}

}  // namespace crumple
