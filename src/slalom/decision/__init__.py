"""The decision of one robot: inputs as tables, policy, fallbacks where nothing is safe, and outcome."""

from slalom.decision.decision import Commitment, Decision, DecisionInputs, Outcome

__all__ = ["Commitment", "Decision", "DecisionInputs", "Outcome"]
