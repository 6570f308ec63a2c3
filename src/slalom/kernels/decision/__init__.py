"""The decisions of many robots: neighbours, encounters, costs, the policy."""
