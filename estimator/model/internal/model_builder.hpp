// Builds a Model from its specification: finds effects, and resolves parameters, borrowed
// parameters and coordinates. Throws std::invalid_argument that names file, place and error.
// Private to the sources of the model.
#pragma once

#include <string>

#include "estimator/model/model.hpp"

namespace shaker::estimator {

class ModelBuilder {
 public:
  ModelBuilder(Model& model, const config::ModelSpec& spec) : model_(model), spec_(spec) {}
  void build();

 private:
  [[noreturn]] void reject(const std::string& why) const;
  void read_coordinates();
  void add_effect(const config::EffectSpec& spec, std::size_t index);
  const Effect* own_effect(const config::EffectSpec& spec, const std::string& place);
  const Effect* table_effect(const config::EffectSpec& spec, const std::string& place);
  void add_constants(const config::EffectSpec& spec, const std::string& place, Model::Term& term);
  void add_parameters(const config::EffectSpec& spec, std::size_t index, const std::string& place,
                      const Effect& effect);
  void check_formula_unit(const std::string& label, const std::string& place) const;
  void place_in_coordinates(const config::EffectSpec& spec, const std::string& place,
                            Model::Term& term);
  void borrow();
  void sort_by_lender();
  void add_series_coordinate();
  void add_internal_coordinates();
  void finish();

  Model& model_;
  const config::ModelSpec& spec_;
};

}  // namespace shaker::estimator
