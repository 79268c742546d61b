// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/stage_cache.h"

#include <algorithm>

namespace semblance::problems {

StageCache::Value StageCache::GetAny(const std::string& key, const std::function<Value()>& make) {
  std::promise<Value> promise;
  {
    std::unique_lock lock(mutex_);
    if (const auto it = values_.find(key); it != values_.end()) {
      const std::shared_future<Value> there = it->second;
      std::erase(order_, key);
      order_.push_back(key);
      lock.unlock();
      return there.get();
    }
    values_[key] = promise.get_future().share();
    order_.push_back(key);
    if (static_cast<int>(order_.size()) > capacity_) {
      values_.erase(order_.front());
      order_.pop_front();
    }
    ++made_;
  }
  try {
    Value value = make();
    promise.set_value(value);
    return value;
  } catch (...) {
    promise.set_exception(std::current_exception());
    const std::lock_guard lock(mutex_);
    values_.erase(key);
    std::erase(order_, key);
    throw;
  }
}

int StageCache::made() const {
  const std::lock_guard lock(mutex_);
  return made_;
}

}  // namespace semblance::problems
