MODULE NamesLikeKeywords
  VAR num error1:=1;
  VAR num testing:=1;
  VAR num iffy;
  VAR orient orient1;
  VAR num moduleNo;
  VAR switch id;
  VAR num exp;
  PROC endless()
    Stop;
    ExitCycle;
    ForEach 1;
    tester:=id+exp-arg;
    toPos:=doIt*notNow;
    defaults: var1:=1;
    GOTO defaults;
  ENDPROC
ENDMODULE
