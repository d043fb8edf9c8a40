#pragma once

#include <string>
#include <vector>

namespace sqslam {

// Choice of the views from which a keyframe's depth is estimated.
struct ViewOptions {
  double small_angle = 3.0;   // degrees between the rays of the nearer pair of views
  double large_angle = 6.0;   // degrees between the rays of the farther pair
  double fine_angle = 12.0;   // degrees, for the pair that refines planes together with the farther one
  double min_angle = 0.8;     // degrees; views with less carry no information on depth
  double min_overlap = 0.5;   // share of the keyframe's map points that a view must see
  double near_margin = 1.25;  // inverse depth of the first plane over that of the nearest map points
  double far_margin = 0.75;   // inverse depth of the last plane over that of the farthest map points
  int window = 150;           // frames before and after the keyframe among which views are chosen

  void VisitFields(auto&& visit) {
    visit("small_angle", small_angle, 0.1, 45.0);
    visit("large_angle", large_angle, 0.1, 45.0);
    visit("fine_angle", fine_angle, 0.1, 45.0);
    visit("min_angle", min_angle, 0.0, 45.0);
    visit("min_overlap", min_overlap, 0.0, 1.0);
    visit("near_margin", near_margin, 1.0, 10.0);
    visit("far_margin", far_margin, 0.0, 1.0);
    visit("window", window, 1, 10000);
  }
};

// Matching costs of a plane sweep, and their aggregation.
struct StereoOptions {
  int planes = 96;     // depth hypotheses, evenly spaced in inverse depth
  double noise = 2.0;  // grey levels, standard deviation of image noise: fainter texture counts less
  // On the scale of matching costs, where a ZNCC of 1 costs 0 and one of 0 costs 254:
  int small_penalty = 8;      // cost of a step to the next plane between neighbouring pixels
  int large_penalty = 60;     // cost of any farther step
  double edge_contrast = 10;  // grey levels between neighbouring pixels that halve large_penalty
  double max_cost = 150.0;    // of the plane found, above which a pixel has no depth
  int refinements = 2;        // rounds of finer steps about the planes found

  int smoothing = 6;  // pixels, radius in which a plane is fitted to depths of one surface; 0: none

  void VisitFields(auto&& visit) {
    visit("planes", planes, 8, 1024);
    visit("noise", noise, 0.1, 100.0);
    visit("small_penalty", small_penalty, 0, 1000);
    visit("large_penalty", large_penalty, 0, 1000);
    visit("edge_contrast", edge_contrast, 0.1, 1000.0);
    visit("max_cost", max_cost, 0.0, 255.0);
    visit("refinements", refinements, 0, 10);
    visit("smoothing", smoothing, 0, 50);
  }
};

// Consistency of depth maps, and the cloud made from them.
struct DepthFusionOptions {
  int neighbours = 8;  // depth maps that each one is compared with
  // Neighbours that must confirm a pixel; it is dropped if more of them see through it.
  int min_views = 2;
  double max_difference = 0.0125;  // share of the depth by which agreeing depths may differ
  // Smaller isolated pieces of the cloud are dropped; share of an image.
  double min_piece = 0.01;
  // Edge of the cubes that each hold one point of the cloud, pixels at the median depth.
  double spacing = 1.0;

  void VisitFields(auto&& visit) {
    visit("neighbours", neighbours, 1, 100);
    visit("min_views", min_views, 1, 100);
    visit("max_difference", max_difference, 0.0, 1.0);
    visit("min_piece", min_piece, 0.0, 1.0);
    visit("spacing", spacing, 0.1, 100.0);
  }
};

// Planes that fill regions of one colour, which have no texture to match.
struct FillOptions {
  bool enabled = true;           // fill plain regions
  double max_step = 3.0;         // grey levels of any channel between neighbouring pixels of a region
  int min_pixels = 60;           // least size of a region, and of its part with depth
  double min_support = 0.7;      // share of its known depths that must lie on one plane
  double min_share = 0.15;       // share that must lie on each of several planes, if no single one has enough
  double max_difference = 0.03;  // distance of a depth from the plane, share of the depth

  void VisitFields(auto&& visit) {
    visit("enabled", enabled);
    visit("max_step", max_step, 0.0, 255.0);
    visit("min_pixels", min_pixels, 3, 1000000);
    visit("min_support", min_support, 0.0, 1.0);
    visit("min_share", min_share, 0.01, 1.0);
    visit("max_difference", max_difference, 0.0, 1.0);
  }
};

// The surface fused from the depth maps, and its mesh.
struct SurfaceOptions {
  double voxel = 2.0;          // edge of the volume's cubes, pixels at the median depth
  double truncation = 4.0;     // voxels in front of and behind a measured depth
  double memory_mib = 192.0;   // of the volume; voxels grow if it would need more
  int min_island = 400;        // triangles; smaller pieces of the mesh are dropped
  int max_triangles = 600000;  // of the mesh, which is simplified to this many

  void VisitFields(auto&& visit) {
    visit("voxel", voxel, 0.1, 100.0);
    visit("truncation", truncation, 1.0, 20.0);
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
