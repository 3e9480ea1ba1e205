#pragma once
// PPO's loss for one row and its derivatives by hand, in both generations' forms. Private to learn.
// With rho = exp(nlp_old - nlp): d rho / d nlp = -rho, so the unclipped branch has d L / d nlp = A rho, the clipped 0.

#include <algorithm>
#include <cmath>

namespace consac::learn {

/// What is the same for all rows of a minibatch.
struct PpoLossForm {
  float clip_range = 0.2f;        ///< of the ratio
  float clip_range_vf = -1.0f;    ///< of the value; negative: not clipped
  float vf_coef = 0.5f;           ///< weight of the value loss
  bool halved_value_loss = true;  ///< half the larger of both squared errors (SB2), not the clipped one alone (SB3)
  bool squared_kl = true;         ///< half d^2 (SB2), not e^x - 1 - x (SB3)
};

/// What was collected for a row, and what the network says now.
struct PpoLossRow {
  float advantage, returns, old_value, old_neglogp;  ///< of the rollout; the advantage already standardised
  float value, neglogp, ratio;                       ///< now; ratio = exp(old_neglogp - neglogp)
};

/// The row's terms (without 1 / B) and derivatives (of the sum of terms, weighted by vf_coef).
struct PpoLossTerms {
  float policy, value, kl, clipped;  ///< terms; `value` without vf_coef, `clipped` 0 or 1
  float d_neglogp, d_value;          ///< d / d neglogp, d / d value
};

/// Source: Stable Baselines ppo2.py; Stable Baselines3 ppo.py.
inline PpoLossTerms PpoLossOf(const PpoLossForm& form, const PpoLossRow& row) {
  PpoLossTerms terms;
  const float plain = -row.advantage * row.ratio;
  const float clipped = -row.advantage * std::clamp(row.ratio, 1.0f - form.clip_range, 1.0f + form.clip_range);
  terms.policy = std::max(plain, clipped);
  terms.d_neglogp = plain >= clipped ? row.advantage * row.ratio : 0.0f;
  const float moved = row.neglogp - row.old_neglogp;
  terms.kl = form.squared_kl ? 0.5f * moved * moved : row.ratio - 1.0f + moved;
  terms.clipped = std::fabs(row.ratio - 1.0f) > form.clip_range ? 1.0f : 0.0f;

  const bool clips = form.clip_range_vf >= 0.0f;
  const float change = row.value - row.old_value, error = row.value - row.returns;
  const float clipped_error =
      clips ? row.old_value + std::clamp(change, -form.clip_range_vf, form.clip_range_vf) - row.returns : error;
  const bool use_plain = !clips || (form.halved_value_loss && error * error >= clipped_error * clipped_error);
  const bool moves = use_plain || std::fabs(change) <= form.clip_range_vf;
  const float chosen = use_plain ? error : clipped_error;
  const float half = form.halved_value_loss ? 0.5f : 1.0f;
  terms.value = half * chosen * chosen;
  terms.d_value = moves ? form.vf_coef * 2.0f * half * chosen : 0.0f;
  return terms;
}

}  // namespace consac::learn
