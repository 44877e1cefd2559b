#include "recon/merge.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "recon/site_map.h"
#include "solvers/parallel.h"

namespace crumple {
namespace {

constexpr std::size_t merge_block = 4096;
constexpr double along_spacings = 0.75;    // a square grid's gaps are 0.71 of its pitch from its points
constexpr double across_spacings = 1;      // to join a site
constexpr double contradict_spacings = 4;  // to contradict it
constexpr double least_cosine = 0.5;
constexpr double least_sigma_mm = 1e-4;
constexpr double robust_scale = 1.4826;

double variance_along(const CloudPoint& point, const Eigen::Vector3f& normal) {
  return std::max<double>(normal.dot(point.covariance_mm2 * normal), least_sigma_mm * least_sigma_mm);
}

double median_difference(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

class CloudMerger::Impl {
 public:
  explicit Impl(const MergeOptions& options) : options_(options), map_(contradict_spacings * options.spacing_mm) {
    report_.spacing_mm = options.spacing_mm;
  }

  void add(const Cloud& station, const StationPlace& place) {
    place_ = place;
    view_ = station.points.empty() ? std::uint16_t{0} : station.points.front().view;
    const std::uint16_t index = index_of(station);
    report_.stations.push_back({.station = station.stations.front(), .view = view_, .points = station.points.size()});
    report_.points_in += station.points.size();
    const std::vector<int> matches = match(station.points);
    sums_.assign(map_.sites.size(), {});
    const int earlier = static_cast<int>(map_.sites.size());
    for (std::size_t i = 0; i < station.points.size(); ++i) {
      const CloudPoint& point = station.points[i];
      if (point.normal.isZero(0)) {
        ++report_.without_normal;
        continue;
      }
      const int site = matches[i] >= 0 ? matches[i] : join_or_open(point, index);
      report_.stations.back().shared_points += site < earlier;
      add_to(sums_[site], point, map_.sites[site]);
    }
    fuse(compare(), index);
    ++additions_;
  }

  MergedCloud finish() {
    MergedCloud merged;
    merged.cloud.frame = frame_;
    merged.cloud.stations = stations_;
    const std::vector<Standing> standings = find_contradictions();
    std::vector<std::optional<std::size_t>> point_of_site(map_.sites.size());
    std::size_t overlapping = 0;
    for (std::size_t i = 0; i < map_.sites.size(); ++i) {
      if (standings[i] == Standing::outvoted) {
        ++report_.outvoted;
        continue;
      }
      point_of_site[i] = merged.cloud.points.size();
      merged.cloud.points.push_back(point_of(map_.sites[i]));
      overlapping += map_.sites[i].additions > 1;
      if (standings[i] != Standing::contradicted) continue;
      ++report_.contradictions;
      merged.cloud.points.back().quality = 0;
    }
    merged.cloud.shares = shares(point_of_site);
    report_.points_out = merged.cloud.points.size();
    if (report_.points_out > 0) {
      report_.overlap_share = static_cast<double>(overlapping) / static_cast<double>(report_.points_out);
    }
    merged.report = report_;
    return merged;
  }

 private:
  struct SiteShare {
    std::uint32_t site = 0;
    std::uint16_t view = 0;
    double weight = 0;
  };
  enum class Standing : std::uint8_t { sound, contradicted, outvoted };

  template <typename Work>
  void in_blocks(std::size_t count, const Work& work) const {
    parallel_for((count + merge_block - 1) / merge_block, options_.threads, [&](std::size_t block) {
      const std::size_t end = std::min(count, (block + 1) * merge_block);
      for (std::size_t i = block * merge_block; i < end; ++i) work(i);
    });
  }

  std::uint16_t index_of(const Cloud& station) {
    frame_ = station.frame;
    const auto known = std::find(stations_.begin(), stations_.end(), station.stations.front());
    const auto index = static_cast<std::uint16_t>(known - stations_.begin());
    if (known == stations_.end()) stations_.push_back(station.stations.front());
    return index;
  }

  // The nearest of the sites that the point may join; -1 where there is none.
  int site_for(const CloudPoint& point) const {
    const double along = along_spacings * options_.spacing_mm, across = across_spacings * options_.spacing_mm;
    int best = -1;
    double best_square = 0;
    map_.near(point.position_mm, std::hypot(along, across), [&](int i) {
      const Site& site = map_.sites[i];
      const Eigen::Vector3d offset = point.position_mm - site.place_mm;
      const double square = offset.squaredNorm();
      if (best >= 0 && (square > best_square || (square == best_square && i > best))) return;
      const double height = offset.dot(site.normal.cast<double>());
      if (std::abs(height) > across || square - height * height > along * along) return;
      if (site.normal.dot(point.normal) < least_cosine) return;
      best = i;
      best_square = square;
    });
    return best;
  }

  std::vector<int> match(const std::vector<CloudPoint>& points) const {
    std::vector<int> matches(points.size(), -1);
    if (!map_.sites.empty()) in_blocks(points.size(), [&](std::size_t i) { matches[i] = site_for(points[i]); });
    return matches;
  }

  int join_or_open(const CloudPoint& point, std::uint16_t station) {
    if (const int found = site_for(point); found >= 0) return found;
    return open(point.position_mm, point.normal, station);
  }

  int open(const Eigen::Vector3d& place_mm, const Eigen::Vector3f& normal, std::uint16_t station) {
    Site site;
    site.place_mm = place_mm;
    site.normal = normal;
    site.station = station;
    sums_.emplace_back();
    return map_.add(site);
  }

  static void add_to(StationSum& sum, const CloudPoint& point, const Site& site) {
    const double information = 1 / variance_along(point, site.normal);
    sum.information += information;
    sum.weighted += information * (point.position_mm - site.place_mm);
    sum.normal += point.normal;
    sum.intensity += point.intensity;
    sum.quality += point.quality;
    ++sum.points;
  }

  // Height of this station over the earlier ones at a site; nothing where only one of them saw it.
  std::optional<double> difference_at(std::size_t i) const {
    const Site& site = map_.sites[i];
    const StationSum& sum = sums_[i];
    if (sum.points == 0 || site.additions == 0) return std::nullopt;
    const Eigen::Vector3d apart = sum.weighted / sum.information - site.weighted / site.weight;
    return apart.dot(site.normal.cast<double>());
  }

  // Fills in the last station's report; returns the variance that is common to its differences.
  double compare() {
    StationOverlap& overlap = report_.stations.back();
    std::vector<double> differences;
    for (std::size_t i = 0; i < sums_.size(); ++i) {
      if (const auto difference = difference_at(i)) differences.push_back(*difference);
    }
    overlap.shared_sites = differences.size();
    if (differences.empty()) return 0;
    overlap.offset_mm = median_difference(differences);
    for (double& difference : differences) difference = std::abs(difference);
    overlap.difference_mm = robust_scale * median_difference(std::move(differences));
    return overlap.difference_mm * overlap.difference_mm;
  }

  // What rig and pose put on this station's points there alike, along the normal.
  double common_variance_at(const Site& site) const {
    const Eigen::Vector3d in_probe = place_.world_from_probe.inverse() * site.place_mm;
    const Eigen::RowVector3d normal = site.normal.cast<double>();
    const Eigen::Matrix<double, 1, 6> d_pose = normal * d_transformed_d_pose(place_.world_from_probe, in_probe);
    return options_.common_sigma_mm * options_.common_sigma_mm + d_pose * place_.covariance * d_pose.transpose();
  }

  // Weights over their sums, point by point; a point of one view needs none.
  std::vector<CloudShare> shares(const std::vector<std::optional<std::size_t>>& point_of_site) const {
    std::vector<CloudShare> result;
    for (const SiteShare& share : shares_) {
      const Site& site = map_.sites[share.site];
      if (site.additions == 1 || !point_of_site[share.site]) continue;
      result.push_back({static_cast<std::uint32_t>(*point_of_site[share.site]), share.view,
                        static_cast<float>(share.weight / site.weight)});
    }
    std::stable_sort(result.begin(), result.end(),
                     [](const CloudShare& a, const CloudShare& b) { return a.point < b.point; });
    return result;
  }

  void fuse(double scatter_mm2, std::uint16_t station) {
    const std::size_t before_splits = sums_.size();
    for (std::size_t i = 0; i < before_splits; ++i) {
      if (sums_[i].points == 0) continue;
      const auto difference = difference_at(i);
      const double variance =
          1 / sums_[i].information + common_variance_at(map_.sites[i]) + (difference ? 1 / map_.sites[i].weight : 0);
      if (!difference || *difference * *difference <= options_.gate * std::max(variance, scatter_mm2)) {
        fuse_into(i, sums_[i]);
        continue;
      }
      ++report_.stations.back().split;
      StationSum sum = sums_[i];
      const Eigen::Vector3d offset = sum.weighted / sum.information;
      const int own = open(map_.sites[i].place_mm + offset, sum.normal.normalized(), station);
      sum.weighted.setZero();
      fuse_into(static_cast<std::size_t>(own), sum);
    }
  }

  void fuse_into(std::size_t index, const StationSum& sum) {
    Site& site = map_.sites[index];
    const double noise = 1 / sum.information;
    const double weight = 1 / (noise + common_variance_at(site));
    shares_.push_back({static_cast<std::uint32_t>(index), view_, weight});
    if (site.additions == 0) site.view = view_;
    site.weight += weight;
    site.noise += weight * weight * noise;
    site.weighted += weight * (sum.weighted / sum.information);
    site.normals += static_cast<float>(weight) * sum.normal.normalized();
    site.intensity += sum.intensity;
    site.quality += sum.quality;
    site.points += sum.points;
    ++site.additions;
    site.seen_by |= std::uint64_t{1} << (additions_ % 64U);
  }

  static Eigen::Vector3d position(const Site& site) { return site.place_mm + site.weighted / site.weight; }

  static CloudPoint point_of(const Site& site) {
    CloudPoint point;
    point.position_mm = position(site);
    point.normal = site.normals.normalized();
    point.intensity = site.intensity / static_cast<float>(site.points);
    point.quality = site.quality / static_cast<float>(site.points);
    point.sigma_mm = static_cast<float>(std::sqrt(site.noise) / site.weight);
    point.covariance_mm2 = point.sigma_mm * point.sigma_mm * point.normal * point.normal.transpose();
    point.station = site.station;
    point.view = site.view;
    return point;
  }

  std::vector<Standing> find_contradictions() const {
    std::vector<Standing> standings(map_.sites.size(), Standing::sound);
    in_blocks(standings.size(), [&](std::size_t i) { standings[i] = standing_of(map_.sites[i]); });
    return standings;
  }

  Standing standing_of(const Site& site) const {
    const double along = along_spacings * options_.spacing_mm, across = contradict_spacings * options_.spacing_mm;
    const Eigen::Vector3d place = position(site);
    Standing standing = Standing::sound;
    map_.near(place, std::hypot(along, across), [&](int i) {
      const Site& other = map_.sites[i];
      if ((other.seen_by & site.seen_by) != 0 || other.normal.dot(site.normal) < least_cosine) return;
      const Eigen::Vector3d offset = position(other) - place;
      const double height = offset.dot(site.normal.cast<double>());
      if (std::abs(height) > across || offset.squaredNorm() - height * height > along * along) return;
      if (height * height <= options_.gate * (1 / site.weight + 1 / other.weight)) return;
      const bool outvoted = site.additions == 1 && other.additions > 1;
      standing = std::max(standing, outvoted ? Standing::outvoted : Standing::contradicted);
    });
    return standing;
  }

  const MergeOptions options_;
  StationPlace place_;  // of the station at hand
  SiteMap map_;
  std::uint16_t view_ = 0;        // likewise
  std::vector<StationSum> sums_;  // of the station at hand, one per site
  std::vector<SiteShare> shares_;
  std::vector<std::string> stations_;
  std::string frame_;
  unsigned additions_ = 0;
  MergeReport report_;
};

CloudMerger::CloudMerger(const MergeOptions& options) : impl_(std::make_unique<Impl>(options)) {
  assert(options.spacing_mm > 0);
}
CloudMerger::~CloudMerger() = default;
CloudMerger::CloudMerger(CloudMerger&&) noexcept = default;
CloudMerger& CloudMerger::operator=(CloudMerger&&) noexcept = default;

void CloudMerger::add(const Cloud& station, const StationPlace& place) { impl_->add(station, place); }
MergedCloud CloudMerger::finish() { return impl_->finish(); }

}  // namespace crumple
