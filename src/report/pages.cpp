// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "report/pages.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"
#include "risley/estimation/weak_directions.hpp"
#include "risley/report/html.hpp"

#include "report/flight_unknowns.hpp"

namespace risley::report {

using json::Json;

Json page_of(TrainShape shape, const std::vector<jobs::ReadRecording>& recordings) {
  Json list = Json::array();
  for (const jobs::ReadRecording& one : recordings) {
    list.push_back({{"name", file_name(one.path)}});
    list.back().update(json::of(one));
  }
  Json page{{"prisms", int{shape.prisms}}, {"emitters", shape.emitters}, {"recordings", list}};
  if (shape.prisms.reflects()) page["reflects"] = true;
  return page;
}

Json correlation_json(const std::vector<std::string>& names, const Eigen::MatrixXd& covariance) {
  Json matrix = Json::array();
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    matrix.push_back(Json::array());
    for (Eigen::Index j = 0; j < covariance.cols(); ++j) {
      matrix.back().push_back(covariance(i, j) / std::sqrt(covariance(i, i) * covariance(j, j)));
    }
  }
  return {{"names", names}, {"matrix", matrix}};
}

Json correlation_json(const std::vector<estimation::FreeParameter>& free,
                      const Eigen::MatrixXd& covariance) {
  std::vector<std::string> names;
  names.reserve(free.size());
  for (const estimation::FreeParameter& one : free) names.push_back(one.name);
  return correlation_json(names, covariance);
}

TrainShape shape_of(const View& report) {
  const View page = report["page"];
  const TrainLayout layout = page.has("reflects")
                                 ? kWedgeAndReflector
                                 : TrainLayout(static_cast<int>(page["prisms"].count()));
  return {layout, static_cast<int>(page["emitters"].count())};
}

std::string file_name(const std::string& path) { return path.substr(path.find_last_of('/') + 1); }

std::string recording_names(const View& report) {
  std::string names;
  for (const View& one : report["page"]["recordings"].list()) {
    names += (names.empty() ? "" : ", ") + one["name"].text();
  }
  return names;
}

std::string title_of(const View& report) {
  const std::vector<View> recordings = report["page"]["recordings"].list();
  if (recordings.empty()) return "";
  const std::string title = ": " + recordings.front()["name"].text();
  return recordings.size() == 1 ? title
                                : fmt::format("{} and {} more", title, recordings.size() - 1);
}

std::uint64_t observations_of(const View& report) {
  std::uint64_t rows = 0;
  for (const View& one : report["page"]["recordings"].list()) rows += one["observations"].count();
  return rows;
}

ParameterWords parameter_words(const std::string& name, TrainShape shape) {
  const UnknownInfo info = unknown_info(name, shape);
  return {parameter_head(info.long_name, info.symbol, name), symbol_html(info.symbol), info.unit};
}

bool any_held_parameter(const View& parameters) {
  const auto all = parameters.entries();
  return std::any_of(all.begin(), all.end(), [](const auto& one) {
    return one.second["sigma"].number() > one.second["sigma_given_held"].number();
  });
}

double number_of(const View& by_name, const std::string& name) {
  return by_name.has(name) ? by_name[name].number() : kUnknown;
}

std::vector<std::string> weak_directions(const View& unobservable) {
  std::vector<std::string> items;
  for (const View& one : unobservable.list()) {
    estimation::WeakDirection weak;
    for (const auto& [name, weight] : one["direction"].entries()) {
      weak.weights.emplace_back(name, weight.number());
    }
    items.push_back(fmt::format("{}: its sigma remains {}", direction_text(weak),
                                finite_text("{:.2g}", one["sigma"].number())));
  }
  return items;
}

Verdict verdict_of(const View& report) {
  Verdict verdict;
  verdict.converged = report["converged"].flag();
  verdict.reason = report["reason"].text();
  verdict.code = report["verdict"]["code"].text();
  verdict.words = report["verdict"]["words"].text();
  verdict.to_do = report["verdict"]["to_do"].text();
  for (const View& one : report["warnings"].list()) {
    verdict.warnings.push_back(one["message"].text());
  }
  return verdict;
}

std::string angle_text(const View& angle) {
  const NumberText text = number_text(angle["value"].number(), angle["sigma"].number());
  return fmt::format("{}° ± {}°", text.value, text.sigma);
}

std::string offset_of(double degrees) { return offset_text(radians_from_degrees(degrees)); }

void add_end(Sections& sections, const View& report) {
  const View page = report["page"];
  std::vector<CorrelationHead> heads;
  for (const std::string& name : page["correlation"]["names"].texts()) {
    const ParameterWords words = parameter_words(name, shape_of(report));
    heads.push_back({words.head_html, words.symbol_html});
  }
  sections.add(kCorrelations, correlation_html(heads, page["correlation"]["matrix"]));
  sections.add(kTimes, time_audit_html(page["recordings"]));
  jobs::Provenance provenance;
  for (const View& one : report["provenance"].list()) {
    const std::vector<std::string> pair = one.texts();
    provenance.emplace_back(pair.at(0), pair.at(1));
  }
  sections.add(kHowToRepeat, provenance_html(provenance));
}

}  // namespace risley::report
