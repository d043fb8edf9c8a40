#pragma once

#include <string>
#include <vector>

namespace sqslam {

// Choice of the views from which a keyframe's depth is estimated.
struct ViewOptions {
  double min_overlap = 0.5;  // share of the keyframe's map points that a view must see
  int window = 150;          // frames before and after the keyframe among which views are chosen

  void VisitFields(auto&& visit) { visit("min_overlap", min_overlap, 0.0, 1.0); }
};

// Matching costs of a plane sweep, and their aggregation.
struct StereoOptions {
  int planes = 96;  // depth hypotheses, evenly spaced in inverse depth
  // On the scale of matching costs, where a ZNCC of 1 costs 0 and one of 0 costs 254:
  int small_penalty = 8;      // cost of a step to the next plane between neighbouring pixels
  int large_penalty = 60;     // cost of any farther step
  double edge_contrast = 10;  // grey levels between neighbouring pixels that halve large_penalty
  int refinements = 2;        // rounds of finer steps about the planes found

  void VisitFields(auto&& visit) { visit("planes", planes, 8, 512); }
};

// Consistency of depth maps.
struct DepthFusionOptions {
  // Neighbours that must confirm a pixel; it is dropped if more of them see through it.
  int min_views = 2;
  double max_sigma = 0.03;  // predicted standard deviation of a kept depth, share of the depth

  void VisitFields(auto&& visit) {
    visit("min_views", min_views, 1, 100);
    visit("max_sigma", max_sigma, 1e-4, 1.0);
  }
};

// Planes that fill regions of one colour, which have no texture to match.
struct FillOptions {
  bool enabled = true;  // fill plain regions

  void VisitFields(auto&& visit) { visit("enabled", enabled); }
};

// The surface fused from the depth maps, and its mesh.
struct SurfaceOptions {
  double voxel = 2.0;          // edge of the volume's cubes, pixels at the median depth
  double memory_mib = 192.0;   // of the volume; voxels grow if it would need more
  int min_island = 400;        // triangles; smaller pieces of the mesh are dropped
  int max_triangles = 600000;  // of the mesh, which is simplified to this many

  void VisitFields(auto&& visit) {
    visit("voxel", voxel, 0.1, 100.0);
    visit("memory_mib", memory_mib, 1.0, 100000.0);
    visit("min_island", min_island, 0, 1000000000);
    visit("max_triangles", max_triangles, 100, 1000000000);
  }
};

struct DenseOptions {
  double scale = 0.5;  // size of the images for depth estimation over that of the frames
  // Detections with these labels are moving objects: their boxes get no depth.
  std::vector<std::string> moving_labels = {"person", "cat", "dog", "bird"};
  ViewOptions views;
  StereoOptions stereo;
  DepthFusionOptions fusion;
  FillOptions fill;
  SurfaceOptions surface;

  void VisitFields(auto&& visit) {
    visit("scale", scale, 0.05, 1.0);
    visit("moving_labels", moving_labels);
    visit("views", views);
    visit("stereo", stereo);
    visit("fusion", fusion);
    visit("fill", fill);
    visit("surface", surface);
  }
};

}  // namespace sqslam
