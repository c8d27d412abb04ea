#include "pcl_icp.hpp"

#ifdef WELDCELL_HAVE_PCL
#include <pcl/point_types.h>
#include <pcl/registration/icp.h>
#include <pcl/registration/transformation_estimation_2D.h>

#include <cmath>

namespace weldcell::bench {

namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Icp = pcl::IterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ>;

constexpr double kSample_mm = 0.5;
constexpr double kAccept_mm = 2.5;

Cloud::Ptr sampled(const workpiece::OutlineTemplate& outline) {
  Cloud::Ptr cloud(new Cloud);
  for (const workpiece::VisibleEdge& e : outline.edges) {
    const double length = (e.line.b - e.line.a).norm();
    const int steps = std::max(1, static_cast<int>(length / kSample_mm));
    for (int i = 0; i <= steps; ++i) {
      const Vec2 p = e.line.a + (e.line.b - e.line.a) * (static_cast<double>(i) / steps);
      cloud->push_back({static_cast<float>(p.x()), static_cast<float>(p.y()), 0.0F});
    }
  }
  return cloud;
}

}  // namespace

bool has_pcl() { return true; }

Solve pcl_icp_of(const PartUnderTest& part) {
  // One search tree a part, as ours has its fields ready before the scan.
  auto tree = std::make_shared<pcl::search::KdTree<pcl::PointXYZ>>();
  Cloud::Ptr outline = sampled(part.outline());
  tree->setInputCloud(outline);
  return [outline, tree](const EdgeSet& set) {
    Cloud::Ptr points(new Cloud);
    for (const EdgePoint& p : set.edges)
      points->push_back({static_cast<float>(p.x_mm), static_cast<float>(p.y_mm), 0.0F});
    Icp icp;
    icp.setTransformationEstimation(
        std::make_shared<pcl::registration::TransformationEstimation2D<pcl::PointXYZ, pcl::PointXYZ>>());
    icp.setSearchMethodTarget(tree, true);
    icp.setInputTarget(outline);
    icp.setInputSource(points);
    icp.setMaximumIterations(60);
    icp.setTransformationEpsilon(1e-10);
    Eigen::Matrix4f base_to_part = Eigen::Matrix4f::Identity();
    for (const double reach : {40.0, 20.0, 8.0, 3.0}) {
      icp.setMaxCorrespondenceDistance(reach);
      Cloud moved;
      icp.align(moved, base_to_part);
      base_to_part = icp.getFinalTransformation();
    }
    localize::Localization found;
    const double turn = std::atan2(base_to_part(1, 0), base_to_part(0, 0));
    found.pose = Pose2{base_to_part(0, 3), base_to_part(1, 3), turn}.inverse();
    found.mean_error_mm = std::sqrt(icp.getFitnessScore());
    found.verdict = found.mean_error_mm <= kAccept_mm ? localize::Verdict::Weld : localize::Verdict::Reject;
    return found;
  };
}

}  // namespace weldcell::bench
#else
namespace weldcell::bench {

bool has_pcl() { return false; }

Solve pcl_icp_of(const PartUnderTest&) {
  return [](const EdgeSet&) { return localize::Localization{}; };
}

}  // namespace weldcell::bench
#endif
