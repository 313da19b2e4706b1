/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Fusion of light: the part of a Fuser that does not depend on the pixel type.
 */
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fuse/coded_stream.h"
#include "fuse/collaborative_filter.h"
#include "fuse/linear_filter.h"
#include "fuse/motion.h"
#include "fuse/partner_fit.h"
#include "fuse/predictions.h"
#include "fuse/refine.h"
#include "fuse/static_pixels.h"
#include "fuse/uncertainty.h"

namespace codedexposure::fuse
{

/** Light in the coded frame to light in every slot; see Fuser. */
class Engine
{
public:
  /** @p partner  what partners see; null: there are none.
   * Throws Stopped after a stop. */
  static Result<std::unique_ptr<Engine>> make (const Schedule &schedule,
      const Schedule *partner, int width, int height,
      const FuseOptions &options, double steps, std::stop_token stop);

  int slots () const { return observation_.slots (); }
  Extent size () const { return size_; }
  const Kernels &kernels () const { return kernels_; }
  CodedStream &stream () { return *stream_; }
  /** Weight of static pixels of the last frame, 0 to 1. */
  const Field &is_static () const { return static_pixels_->weight (); }

  /** Why options.refine has no effect here; empty if it has or is not set. */
  const std::string &unrefined () const { return unrefined_; }

  /** Fuses the oldest frame of stream (), and takes it from there.
   * @p deviations  gets the half-width of the 68 % interval of each pixel, if
   *                 it is set.
   * After Stopped, forget () is to be called. */
  void fuse (const RowSink &sink, const Task &task,
      const Uncertainty::Sink &deviations = {});
  /** Takes the oldest frame away, after what those behind it need to know of
   * it. */
  void pass (Workers &workers);
  void forget ();

private:
  Engine (const Schedule &schedule, const Schedule *partner, Extent size,
      const FuseOptions &options, double steps, std::stop_token stop);
  /** What is found in coded frames before any slot is estimated. */
  struct Seen {
    const Predictions::Found &predicted;
    StaticPixels::Found still;
  };
  /** Of a frame whose partner does not tell of all pixels, what the first
   * camera alone tells. */
  Seen look (const CodedFrames &frames, const Task &task);
  void fuse_frame (const CodedFrames &frames, const RowSink &sink,
      const Task &task, const Uncertainty::Sink &deviations);
  void fill_light (
      const CodedFrames &frames, const Seen &seen, const Task &task);
  /** Light, refined if it is to be. @p deviations  whether they are wanted. */
  void fill (const CodedFrames &frames, const Seen &seen, bool deviations,
      const Task &task);
  void fill_clipped (const CodedFrames &frames, const Seen &seen,
      bool deviations, const Task &task);
  /** PartnerFit of light_; @p made, if set, gets what that makes in the
   * partner.
   */
  void fit_partner (
      const CodedFrames &frames, const Task &task, Field *made = nullptr);
  void blend_static (const StaticPixels::Found &still);
  /** Standard deviation of coded pixels in grey levels. */
  double typical_noise () const;

  const Schedule schedule_;
  const Extent size_;
  const FuseQuality quality_;
  const double depth_; ///< steps of pixels from black to white
  const Observation observation_;
  const std::optional<Observation> partner_;
  const Phases phases_;
  const Kernels &kernels_;
  const NoiseMap noise_;
  std::optional<TapSources> sources_;
  std::optional<FilterPlan> plan_;

  /* The stages, in the order in which a frame passes them; of linear_ and
   * motion_, there is one. */
  std::optional<CodedStream> stream_;
  std::optional<Predictions> predictions_;
  std::optional<StaticPixels> static_pixels_;
  std::optional<PartnerFit> partner_fit_; ///< of linear_, or after the others
  std::optional<LinearFilter> linear_;
  std::optional<MotionFilter> motion_;
  std::optional<CollaborativeFilter> collaborative_;
  std::optional<Refiner> refiner_;
  std::optional<Uncertainty> uncertainty_; ///< made when it is first wanted

  std::vector<Field> light_; ///< of each slot; made when it is first needed
  std::vector<Field> deviations_;               ///< by refiner_
  std::vector<Field> alone_, alone_deviations_; ///< by fill_clipped ()
  Field static_light_;    ///< unless fast, or without noise
  Field misfit_;          ///< of motion_
  Field made_in_partner_; ///< for collaborative_
  std::string unrefined_;
};

} // namespace codedexposure::fuse
