"""Campaigns: many runs of pmsim with drawn machines. docs/campaigns.md is the manual."""
