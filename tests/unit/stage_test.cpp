/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The required stage travel, from the pose of the camera. */
#include <cmath>

#include <gtest/gtest.h>

#include "bench/lens.h"
#include "calibrate/stage.h"

using namespace codedexposure;

namespace
{

constexpr Extent kSize{768, 576};

Mapping
mapping_of (const Alignment &alignment)
{
  const Result<Mapping> mapping = Mapping::make ({kSize, kSize,
      camera_to_mirrors (alignment, kSize.width, kSize.height), {}, {}});
  EXPECT_TRUE (mapping.ok ());
  return *mapping;
}

} // namespace

TEST (Stage, AnAlignedBenchHasNothingToDo)
{
  const StageCorrection todo = correct_stage (mapping_of ({}), {});
  EXPECT_EQ (todo.state, CalibrationStage::aligned);
  EXPECT_NEAR (todo.deviation, 0.0, 1e-9);
  EXPECT_NEAR (todo.stage_x, 0.0, 1e-9);
  EXPECT_NEAR (todo.stage_theta, 0.0, 1e-9);
  EXPECT_NEAR (todo.magnify, 0.0, 1e-9);
}

TEST (Stage, IsSentToTheNearestMirror)
{
  const StageCorrection todo = correct_stage (
      mapping_of ({.shift_x = 17.25, .shift_y = -3.1}), {.mirror_pitch = 10});
  EXPECT_EQ (todo.state, CalibrationStage::fine);
  EXPECT_NEAR (todo.offset.x, 0.25, 1e-9);
  EXPECT_NEAR (todo.offset.y, -0.1, 1e-9);
  EXPECT_NEAR (todo.stage_x, -2.5, 1e-8);
  EXPECT_NEAR (todo.stage_y, 1.0, 1e-8);
  EXPECT_NEAR (todo.deviation, std::hypot (0.25, 0.1), 1e-9);
}

TEST (Stage, TurnsAndMagnifiesBack)
{
  const StageCorrection todo =
      correct_stage (mapping_of ({.rotation = 0.5, .scale = 1.01}), {});
  EXPECT_EQ (todo.state, CalibrationStage::coarse);
  EXPECT_NEAR (todo.stage_theta, -500.0, 1e-6);
  EXPECT_NEAR (todo.magnify, (1 / 1.01 - 1) * 1000, 1e-6);
}

TEST (Stage, DoingAsToldAligns)
{
  Alignment bench{
      .shift_x = 5.3, .shift_y = -2.2, .rotation = -0.7, .scale = 0.99};
  for (int turn = 0; turn < 2; turn++) {
    const StageCorrection todo =
        correct_stage (mapping_of (bench), {.mirror_pitch = 1});
    bench.shift_x += todo.stage_x;
    bench.shift_y += todo.stage_y;
    bench.rotation += todo.stage_theta / 1000;
    bench.scale *= 1 + todo.magnify / 1000;
  }
  EXPECT_EQ (
      correct_stage (mapping_of (bench), {}).state, CalibrationStage::aligned);
}

TEST (Stage, FlipsTurnTheSignsOfTheStage)
{
  const Mapping mapping =
      mapping_of ({.shift_x = 0.2, .shift_y = 0.3, .rotation = 0.1});
  const StageCorrection plain = correct_stage (mapping, {});
  const StageCorrection flipped = correct_stage (
      mapping, {.flip_x = true, .flip_y = true, .flip_theta = true});
  EXPECT_DOUBLE_EQ (flipped.stage_x, -plain.stage_x);
  EXPECT_DOUBLE_EQ (flipped.stage_y, -plain.stage_y);
  EXPECT_DOUBLE_EQ (flipped.stage_theta, -plain.stage_theta);
  EXPECT_DOUBLE_EQ (flipped.offset.x, plain.offset.x);

  const StageCorrection x = correct_stage (mapping, {.flip_x = true});
  EXPECT_DOUBLE_EQ (x.stage_x, -plain.stage_x);
  EXPECT_DOUBLE_EQ (x.stage_y, plain.stage_y);
  EXPECT_DOUBLE_EQ (x.stage_theta, plain.stage_theta);
  const StageCorrection y = correct_stage (mapping, {.flip_y = true});
  EXPECT_DOUBLE_EQ (y.stage_x, plain.stage_x);
  EXPECT_DOUBLE_EQ (y.stage_y, -plain.stage_y);
  EXPECT_DOUBLE_EQ (y.stage_theta, plain.stage_theta);
}

TEST (Stage, SeveralPixelsAMirrorAreAlignedBorderOnBorder)
{
  const Mapping centred = centred_mapping ({768, 576}, {384, 288}, 2.0);
  const StageCorrection todo =
      correct_stage (centred, {.pixels_per_mirror = 2.0});
  EXPECT_EQ (todo.state, CalibrationStage::aligned);
  EXPECT_NEAR (centred.mirror_at (0, 0).x, -0.25, 1e-12);
}
