// A measuring plan carried out on a cloud that `crumple reconstruct` wrote: features, distances and angles with their
// uncertainty by source.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "calib/measured_quantity.h"
#include "datasets/measuring_plan.h"

namespace crumple {

// A cloud with the rig and the stations beside it.
class MeasuredCloud {
 public:
  // `folder` as `crumple reconstruct` wrote it. Fails where a file is missing or damaged, where the folder holds no
  // stations (its summary says why), and where cloud and rig do not belong together.
  static Expected<MeasuredCloud> read(const std::filesystem::path& folder);

  const Cloud& cloud() const { return *cloud_; }
  const PointUncertainty& uncertainty() const { return *uncertainty_; }
  bool scale_known() const { return uncertainty_->scale_variables() > 0; }
  // What the scale's uncertainty does not contain where it is known, in words; empty where it is complete.
  const std::vector<std::string>& scale_lacks() const { return scale_lacks_; }
  const Rig& rig() const { return rig_; }  // that it was reconstructed with
  // How many stations a feature was measured from.
  std::size_t stations_of(const MeasuredFeature& feature) const;

  // In the order given; an error names the feature.
  Expected<std::vector<MeasuredFeature>> measure(const std::vector<PlannedFeature>& features) const;

 private:
  std::unique_ptr<Cloud> cloud_;
  std::unique_ptr<PointUncertainty> uncertainty_;
  std::vector<std::string> scale_lacks_;
  Rig rig_;
};

struct MeasurementReport {
  nlohmann::json document;  // docs/formats.md
  std::string text;
};

Expected<MeasurementReport> measurement_report(const MeasuredCloud& cloud, const MeasuringPlan& plan);

// For reports: a quantity with u, U (k = 2) and its budget, and a line of text with them.
nlohmann::json quantity_json(const MeasuredQuantity& quantity, bool scale_known, double unit = 1);
std::string quantity_line(const std::string& name, const MeasuredQuantity& quantity, const MeasuredCloud& cloud,
                          double unit = 1);
std::string quantity_heading(const std::string& title);
// What is to be said of the scale where it is not known, or not completely: in a report's document, and as a sentence.
void add_scale(const MeasuredCloud& cloud, nlohmann::json& document);
std::string scale_sentence(const MeasuredCloud& cloud);

}  // namespace crumple
